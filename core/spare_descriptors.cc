#include "luxfield/core/spare_descriptors.h"

#include <fcntl.h>

#include <vector>

#include "luxfield/core/descriptor.h"

namespace luxfield::core {

int SpareDescriptors(int wanted) {
  std::vector<Descriptor> held;
  for (int k = 0; k < wanted; ++k) {
    Descriptor one(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (one.get() < 0) break;
    held.push_back(std::move(one));
  }
  return static_cast<int>(held.size());
}

}  // namespace luxfield::core
