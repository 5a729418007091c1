// Some rows of an OpenEXR file's parts: the others are not read.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

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

  // Rows first to first + count - 1 of several channels in one pass over their bytes.
  void Read(int part, std::span<const ExrTarget> targets, int first, int count);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::core
