#include "luxfield/render/estimators/sequences.h"

#include <bit>
#include <cmath>
#include <random>

#include "luxfield/core/random.h"

namespace luxfield::render {
namespace {

cl_uint RadicalInverse(std::uint32_t k, std::uint32_t base) {
  double digit = 1.0 / base, sum = 0;
  for (; k; k /= base, digit /= base) sum += digit * (k % base);
  return static_cast<cl_uint>(std::ldexp(sum, 32));
}

}  // namespace

std::vector<cl_uint2> MakeSequence(Sequence kind, int count, std::uint64_t seed) {
  std::vector<cl_uint2> points(count);
  switch (kind) {
    case Sequence::kHalton:
      for (int k = 0; k < count; ++k)
        points[k] = {{RadicalInverse(k + 1, 2), RadicalInverse(k + 1, 3)}};
      break;
    case Sequence::kSobol: {
      core::Random random(seed, 0);
      cl_uint2 point{{random(), random()}};
      // Second dimension: rows of Pascal's triangle modulo 2.
      cl_uint direction[32] = {0x80000000u};
      for (int bit = 1; bit < 32; ++bit)
        direction[bit] = direction[bit - 1] ^ (direction[bit - 1] >> 1);
      for (int k = 0; k < count; ++k) {
        points[k] = point;
        const int bit = std::countr_one(static_cast<std::uint32_t>(k));
        point.s[0] ^= 0x80000000u >> bit;
        point.s[1] ^= direction[bit];
      }
      break;
    }
    case Sequence::kMersenne: {
      std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
      for (auto& point : points) {
        point.s[0] = static_cast<cl_uint>(random());
        point.s[1] = static_cast<cl_uint>(random());
      }
      break;
    }
  }
  return points;
}

}  // namespace luxfield::render
