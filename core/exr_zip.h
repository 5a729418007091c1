// The ZIP compression of OpenEXR: blocks of pixels as they lie in a file ("Technical Introduction to
// OpenEXR", section ZIP). Internal to core/.
//
// The bytes b of a block become the even ones and then the odd ones, t; of these the differences
//
//   d[0] = t[0],   d[k] = t[k] - t[k - 1] + 128  (mod 256)
//
// are a zlib stream (RFC 1950).
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

struct libdeflate_decompressor;
struct libdeflate_compressor;

namespace luxfield::core {

using ExrBytes = std::span<const unsigned char>;

// Undoes it, block by block. Not for several threads at once.
class ExrUnzipper {
 public:
  explicit ExrUnzipper(std::size_t most_bytes);  // of a block as it was
  ~ExrUnzipper();
  ExrUnzipper(const ExrUnzipper&) = delete;
  ExrUnzipper& operator=(const ExrUnzipper&) = delete;

  // Takes a block that unpacks to `bytes`, even and at most as many as stated; false where it does
  // not.
  bool Take(ExrBytes packed, std::size_t bytes);
  // Bytes `first` to first + to.size() - 1 of the block taken; both even.
  void Copy(std::size_t first, std::span<unsigned char> to) const;

 private:
  libdeflate_decompressor* inflate_;
  std::unique_ptr<unsigned char[]> halves_;  // the even bytes, then the odd ones
  std::size_t bytes_ = 0;
};

// Does it, block by block. Not for several threads at once.
class ExrZipper {
 public:
  explicit ExrZipper(std::size_t most_bytes);
  ~ExrZipper();
  ExrZipper(const ExrZipper&) = delete;
  ExrZipper& operator=(const ExrZipper&) = delete;

  // The block, of an even number of bytes, as it stands in a file: as it is where Huffman codes of
  // its differences, even and odd bytes apart, would save less than 5 %. Valid until the next call,
  // as long as `bytes` are.
  ExrBytes Pack(ExrBytes bytes);

 private:
  libdeflate_compressor* deflate_;
  std::vector<unsigned char> differences_, packed_;
};

}  // namespace luxfield::core
