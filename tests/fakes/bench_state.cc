#include "tests/fakes/bench_state.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <new>
#include <system_error>

namespace luxfield::fakes {

SharedBenchState::SharedBenchState(const std::filesystem::path& file, bool create) {
  const int descriptor =
      open(file.c_str(), (create ? O_CREAT | O_TRUNC : 0) | O_RDWR | O_CLOEXEC, 0600);
  void* memory = MAP_FAILED;
  if (descriptor >= 0 && (!create || ftruncate(descriptor, sizeof(BenchState)) == 0))
    memory = mmap(nullptr, sizeof(BenchState), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (memory == MAP_FAILED) throw std::system_error(error, std::generic_category(), file.string());
  state_ = create ? new (memory) BenchState : static_cast<BenchState*>(memory);
}

SharedBenchState::~SharedBenchState() { munmap(state_, sizeof(BenchState)); }

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace luxfield::fakes
