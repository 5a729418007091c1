// Memory that a library needs which does not bear to be refused it.
#pragma once

#include <cstddef>

namespace luxfield::core {

// Throws std::bad_alloc unless so much address space is to be had now. fontconfig follows null
// pointers where it runs out of memory while it reads its configuration, some megabytes of it.
void RequireSpareMemory(std::size_t bytes);

// What drawing text with cairo needs at most.
inline constexpr std::size_t kTextDrawingBytes = std::size_t{64} << 20;

}  // namespace luxfield::core
