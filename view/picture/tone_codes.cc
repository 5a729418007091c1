#include "luxfield/view/picture/tone_codes.h"

namespace luxfield::view {

// Floats above 0 are ordered as their bits are.
ToneCodes::ToneCodes(const std::function<std::uint8_t(float)>& code) {
  std::uint32_t from = 1;
  for (int c = 1; c < 256; ++c) {
    std::uint32_t low = from, high = kInfinity + 1;
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (code(std::bit_cast<float>(middle)) >= c)
        high = middle;
      else
        low = middle + 1;
    }
    begins_[c] = from = low;
  }
  int guess = 0;
  for (std::uint32_t bucket = 0; bucket < guesses_.size(); ++bucket) {
    while (guess < 255 && begins_[guess + 1] <= bucket << kShift) ++guess;
    guesses_[bucket] = static_cast<std::uint8_t>(guess);
  }
}

}  // namespace luxfield::view
