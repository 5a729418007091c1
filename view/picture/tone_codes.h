// 8-bit codes of a tone operator that acts on each channel by itself, as a table over all floats.
//
//   const ToneCodes codes([&](float value) { return EncodeByte(value * exposure); });
//   const std::uint8_t shown = codes.At(0.3f);
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <functional>

namespace luxfield::view {

class ToneCodes {
 public:
  // `code` never falls where its argument, which is above 0, rises. It is asked some ten thousand
  // times.
  explicit ToneCodes(const std::function<std::uint8_t(float)>& code);

  // code(value), 0 of what is not above 0 or no number.
  std::uint8_t At(float value) const {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits > kInfinity) return 0;
    std::uint8_t code = guesses_[bits >> kShift];
    while (code < 255 && bits >= begins_[code + 1]) ++code;
    return code;
  }

 private:
  static constexpr std::uint32_t kInfinity = 0x7F800000;
  static constexpr int kShift = 16;          // of a float's bits: buckets of 1/128 octave
  std::array<std::uint32_t, 256> begins_{};  // bits of the first float of each code
  std::array<std::uint8_t, (kInfinity >> kShift) + 1> guesses_{};  // code where a bucket begins
};

}  // namespace luxfield::view
