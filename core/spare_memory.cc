#include "luxfield/core/spare_memory.h"

#include <sys/mman.h>

#include <new>

namespace luxfield::core {

void RequireSpareMemory(std::size_t bytes) {
  void* const spare = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (spare == MAP_FAILED) throw std::bad_alloc();
  ::munmap(spare, bytes);
}

}  // namespace luxfield::core
