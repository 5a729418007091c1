// An OpenEXR file whose rows come in bands of all parts, where the file holds part after part.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/exr.h"

namespace luxfield::core {

// Bands are packed as they come and wait beside the file, in scratch that is as large as it is and
// goes with the process. The file is then, to the byte, what WriteExr (kZip) writes of whole parts.
//
//   ExrRowSpool spool(path, parts);
//   for (...) spool.Add(48, [&](int part) { return RowsOf(part); });
//   spool.Write();
class ExrRowSpool {
 public:
  // Pixels of `parts` only say the type; all parts have one height. Throws DeviceError.
  ExrRowSpool(const std::filesystem::path& path, std::vector<ExrPartView> parts);
  ~ExrRowSpool();
  ExrRowSpool(ExrRowSpool&&) noexcept;

  static constexpr int kRows = 16;

  // The next rows of every part, from the top, a multiple of kRows where they are not the last;
  // pixels(part) of width x rows entries are read until the next call. `marked`, empty or one for
  // each kRows of these rows: whether Write has `mend` look at them. Throws DeviceError.
  void Add(int rows, const std::function<std::vector<ExrPixels>(int part)>& pixels,
           const std::vector<bool>& marked = {});

  // What is done to a row of a FLOAT channel that lies in marked rows before it is written.
  using Mend = std::function<void(int part, const std::string& channel, std::span<float> row)>;
  // Writes the file, once all rows are there. Throws DeviceError.
  void Write(const Mend& mend = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::core
