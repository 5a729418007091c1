// How many simulated labs a test draws: few in the suite, $LUXFIELD_LABS in a proof (docs/testing.md).
#pragma once

#include <cstdlib>

namespace luxfield::photometry {

inline int LabsOr(int few) {
  const char* text = std::getenv("LUXFIELD_LABS");
  return text ? std::atoi(text) : few;
}

}  // namespace luxfield::photometry
