// One bit for every pixel of a sensor, rows beginning with words of their own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace luxfield::reconstruct {

constexpr int kBitsOfWord = 64;

class PixelBits {
 public:
  PixelBits() = default;
  // Bits are 0.
  PixelBits(int width, int height)
      : words_of_row_(WordsOfRow(width)),
        words_(std::make_unique<std::uint64_t[]>(static_cast<std::size_t>(words_of_row_) *
                                                 static_cast<std::size_t>(height))) {}

  static int WordsOfRow(int width) { return (width + kBitsOfWord - 1) / kBitsOfWord; }
  // The pixels of a row's last word.
  static std::uint64_t LastWord(int width) {
    const int beyond = WordsOfRow(width) * kBitsOfWord - width;
    return ~std::uint64_t{0} >> beyond;
  }

  explicit operator bool() const { return words_ != nullptr; }
  int words_of_row() const { return words_of_row_; }
  // Bit b of word w is column 64 w + b; those beyond the sensor's width are 0.
  std::uint64_t* row(int r) { return words_.get() + static_cast<std::size_t>(r) * words_of_row_; }
  const std::uint64_t* row(int r) const {
    return words_.get() + static_cast<std::size_t>(r) * words_of_row_;
  }
  bool at(int r, int column) const {
    return row(r)[column / kBitsOfWord] >> (column % kBitsOfWord) & 1;
  }

 private:
  int words_of_row_ = 0;
  std::unique_ptr<std::uint64_t[]> words_;
};

}  // namespace luxfield::reconstruct
