#include "luxfield/reconstruct/calibrate/response/response_samples.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace luxfield::reconstruct {
namespace {

constexpr int kBlock = 3;

struct Block {
  double sum = 0;     // of the exposures' mean codes, clipped ones included
  double spread = 0;  // of the usable exposures, largest less smallest code
  std::vector<std::uint16_t> code;
  std::vector<std::uint8_t> usable;
};

Block MeasureBlock(const PictureStack& stack, int channel, double saturation_code, int row,
                   int column) {
  Block block;
  for (std::size_t k = 0; k < stack.pictures.size(); ++k) {
    const auto plane = stack.plane(k, channel);
    double sum = 0;
    std::uint16_t least = 65535, largest = 0;
    for (int r = row; r < row + kBlock; ++r)
      for (int c = column; c < column + kBlock; ++c) {
        const std::uint16_t code = plane[static_cast<std::size_t>(r) * stack.width + c];
        sum += code;
        least = std::min(least, code);
        largest = std::max(largest, code);
      }
    const bool usable = least > 0 && largest < saturation_code;
    block.sum += sum / (kBlock * kBlock);
    if (usable) block.spread += largest - least;
    block.code.push_back(
        plane[static_cast<std::size_t>(row + kBlock / 2) * stack.width + column + kBlock / 2]);
    block.usable.push_back(usable);
  }
  return block;
}

}  // namespace

double FindSaturationCode(const PictureStack& stack) {
  std::uint16_t largest = 0;
  std::size_t count = 0;
  for (const StackPicture& picture : stack.pictures)
    for (const std::uint16_t code : picture.code) {
      if (code > largest) {
        largest = code;
        count = 0;
      }
      count += code == largest;
    }
  constexpr std::size_t kPile = 100;
  return count >= kPile ? largest : std::ldexp(1.0, stack.bits) - 1;
}

ResponseSamples FlatSamples(const PictureStack& stack, int channel, double saturation_code,
                            int count) {
  std::vector<Block> blocks;
  for (int row = 0; row + kBlock <= stack.height; row += kBlock)
    for (int column = 0; column + kBlock <= stack.width; column += kBlock) {
      Block block = MeasureBlock(stack, channel, saturation_code, row, column);
      if (std::count(block.usable.begin(), block.usable.end(), 1) >= 2)
        blocks.push_back(std::move(block));
    }
  ResponseSamples samples{static_cast<int>(stack.pictures.size()), {}, {}};
  if (blocks.empty()) return samples;
  const auto [least, largest] = std::minmax_element(
      blocks.begin(), blocks.end(), [](const Block& a, const Block& b) { return a.sum < b.sum; });
  const double low = least->sum, range = largest->sum - low + 1e-9;
  constexpr int kPerPart = 10;
  const int parts = std::max(1, count / kPerPart);
  std::vector<std::vector<const Block*>> by_part(parts);
  for (const Block& block : blocks)
    by_part[static_cast<int>(parts * (block.sum - low) / range)].push_back(&block);
  for (auto& part : by_part) {
    std::stable_sort(part.begin(), part.end(),
                     [](const Block* a, const Block* b) { return a->spread < b->spread; });
    for (std::size_t n = 0; n < std::min<std::size_t>(kPerPart, part.size()); ++n) {
      samples.code.insert(samples.code.end(), part[n]->code.begin(), part[n]->code.end());
      samples.usable.insert(samples.usable.end(), part[n]->usable.begin(), part[n]->usable.end());
    }
  }
  return samples;
}

ResponseSamples PixelSamples(const PictureStack& stack, int channel, double saturation_code,
                             int count) {
  ResponseSamples samples{static_cast<int>(stack.pictures.size()), {}, {}};
  const std::size_t pixels = stack.plane_size();
  // A step that has no factor in common with the width visits all columns.
  std::size_t step = std::max<std::size_t>(1, pixels / static_cast<std::size_t>(count));
  while (std::gcd(step, static_cast<std::size_t>(stack.width)) > 1) ++step;
  for (std::size_t p = 0; p < pixels; p += step)
    for (std::size_t k = 0; k < stack.pictures.size(); ++k) {
      const std::uint16_t code = stack.plane(k, channel)[p];
      samples.code.push_back(code);
      samples.usable.push_back(code > 0 && code < saturation_code);
    }
  return samples;
}

ResponseSamples HistogramSamples(const PictureStack& stack, int channel, int count) {
  constexpr int kCodes = 256;
  ResponseSamples samples{static_cast<int>(stack.pictures.size()), {}, {}};
  samples.code.resize(static_cast<std::size_t>(count) * samples.exposures);
  samples.usable.assign(samples.code.size(), 1);
  for (int k = 0; k < samples.exposures; ++k) {
    std::vector<double> cumulative(kCodes, 0.0);
    for (const std::uint16_t code : stack.plane(k, channel))
      ++cumulative[std::min<int>(code, kCodes - 1)];
    std::partial_sum(cumulative.begin(), cumulative.end(), cumulative.begin());
    for (int n = 0; n < count; ++n) {
      const double u = static_cast<double>(n) / (count - 1) * cumulative.back();
      const auto nearest =
          std::min_element(cumulative.begin(), cumulative.end(),
                           [u](double a, double b) { return std::abs(a - u) < std::abs(b - u); });
      samples.code[samples.index(n, k)] = static_cast<std::uint16_t>(nearest - cumulative.begin());
    }
  }
  return samples;
}

}  // namespace luxfield::reconstruct
