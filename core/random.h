// Counter-based random numbers: a draw depends on (seed, stream, index) only, never on threads or
// order.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "luxfield/core/philox.clh"

namespace luxfield::core {

// philox.clh.
inline std::array<std::uint32_t, 4> Philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key) {
  const auto high = [](std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint32_t>(std::uint64_t{a} * b >> 32);
  };
  for (int round = 0; round < LUXFIELD_PHILOX_ROUNDS; ++round)
    LUXFIELD_PHILOX_ROUND(std::uint32_t, high, counter[0], counter[1], counter[2], counter[3],
                          key[0], key[1])
  return counter;
}

// A stream of draws for one (seed, stream, item): e.g. (session seed, frame number, pixel).
class Random {
 public:
  using result_type = std::uint32_t;  // a UniformRandomBitGenerator

  Random(std::uint64_t seed, std::uint64_t stream, std::uint32_t item = 0)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        counter_{0, item, static_cast<std::uint32_t>(stream),
                 static_cast<std::uint32_t>(stream >> 32)} {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xFFFFFFFFu; }
  result_type operator()() {
    if (used_ == 4) {
      block_ = Philox(counter_, key_);
      ++counter_[0];
      used_ = 0;
    }
    return block_[used_++];
  }

  // Uniform in [0, 1), 53 bits.
  double Uniform() {
    const std::uint64_t high = (*this)() >> 5, low = (*this)() >> 6;
    return static_cast<double>((high << 26) | low) * 0x1p-53;
  }
  // Uniform in [0, 1), 24 bits: never rounds to 1.
  float UniformFloat() { return static_cast<float>((*this)() >> 8) * 0x1p-24f; }

  // Standard normal (Box-Muller; two uniforms per draw so that the stream is stateless beyond its
  // counter).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log1p(-Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

  // Poisson: multiplication below a mean of 12, PTRS above (Hoermann 1993), exact in both ranges.
  double Poisson(double mean);

 private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
};

}  // namespace luxfield::core
