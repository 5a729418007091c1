#include "luxfield/core/resident_memory.h"

#include <unistd.h>

#include <fstream>

namespace luxfield::core {

std::uint64_t ResidentBytes() {
  std::uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace luxfield::core
