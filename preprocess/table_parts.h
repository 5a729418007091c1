// The parts of *.tab.exr (table_io.h), one after the other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "luxfield/core/exr.h"
#include "luxfield/preprocess/tables.h"

namespace luxfield::preprocess {

// The part of the reference positions, and its pixels.
class TableReferencePart {
 public:
  TableReferencePart(const Tables& tables, const std::vector<ReferencePosition>& reference);
  core::ExrPartView view() const;  // as long as this lives

 private:
  int width_, height_;
  std::vector<float> s_, t_;
  std::vector<std::uint32_t> images_;
};

// The parts of images first to last - 1, whose tables sat(m) returns in order, valid until the next
// call; behind them that of `reference`, where it is given. `tables` says sizes, exponents and hash.
void WriteTableParts(const std::filesystem::path& path, const Tables& tables, int first, int last,
                     const std::function<std::span<const std::uint64_t>(int m)>& sat,
                     const std::function<std::vector<ReferencePosition>()>& reference);

}  // namespace luxfield::preprocess
