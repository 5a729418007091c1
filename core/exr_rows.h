// Some rows of an OpenEXR file's parts: the others are not read.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/exr.h"

namespace luxfield::core {

// Of a file that `reader` has open, which outlives it. The caller sees to it that parts have the
// channels and the rows. Errors as ExrReader's.
class ExrRowReader {
 public:
  explicit ExrRowReader(const ExrReader& reader);
  ~ExrRowReader();
  ExrRowReader(const ExrRowReader&) = delete;
  ExrRowReader& operator=(const ExrRowReader&) = delete;

  // Rows first to first + count - 1 of several channels in one pass; pixels[i] has width x count
  // entries.
  void ReadFloats(int part, std::span<const std::string> channels,
                  std::span<const std::span<float>> pixels, int first, int count);
  std::vector<std::uint32_t> ReadUint(int part, const std::string& channel, int first, int count);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::core
