// What of memory the process takes.
#pragma once

#include <cstdint>

namespace luxfield::core {

// Its resident set, bytes; 0 where the system does not say.
std::uint64_t ResidentBytes();

}  // namespace luxfield::core
