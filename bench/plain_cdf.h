// The plainest sampler of coefficient images: a table of sums, and a search in it.
#pragma once

#include <cstdint>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::bench {

// Draws image, row and column in proportion to C >= 0 of one channel by three binary searches in
// float32 sums: what a sampler costs that knows nothing of a receiver's windows.
class PlainCdf {
 public:
  explicit PlainCdf(const lightfield::LightField& field);

  struct Texel {
    int image = 0, row = 0, column = 0;
  };
  // For three numbers in [0, 1).
  Texel Draw(float image, float row, float column) const;

  // Seconds for a draw on one thread, its random numbers included; a mean over `count`.
  double SecondsPerDraw(int count, std::uint64_t seed) const;

 private:
  int width_, height_;
  std::vector<float> images_;   // sums over images up to each
  std::vector<float> rows_;     // of each image, over its rows
  std::vector<float> columns_;  // of each row
};

}  // namespace luxfield::bench
