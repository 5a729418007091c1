// Seeds of tests whose random inputs explore: what they claim has to hold for every input. The seed
// of a claim that holds with some probability alone is fixed, or it would fail on some day.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace luxfield {

// `fixed`, mixed with the text $LUXFIELD_SEED where that is set (the date, in CI); printed, so that
// a failure can be had again.
inline std::uint64_t TestSeed(std::uint64_t fixed) {
  std::uint64_t seed = fixed;
  const char* text = std::getenv("LUXFIELD_SEED");
  for (const char c : std::string_view(text ? text : ""))  // FNV-1a
    seed = (seed ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  std::printf("seed %llu (LUXFIELD_SEED=%s)\n", static_cast<unsigned long long>(seed),
              text ? text : "");
  return seed;
}

}  // namespace luxfield
