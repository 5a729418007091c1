#include "luxfield/core/exr_precheck.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/printable.h"

namespace luxfield::core {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kMultiPartFlag = 0x1000;
constexpr double kMostLinesPerChunk = 256;  // DWAB compression
constexpr double kBytesPerOffset = 8;
// DEFLATE shrinks 1032 times at best, DWA stores 8 x 8 pixels as one value at best: together below
// this.
constexpr double kMostPixelsPerByte = 0x1p17;
// Every verb holds a file's channels in memory, some of them twice. What is measured shrinks 10
// times at best; synthetic files of one value are small.
constexpr double kUnaskedBytes = 0x1p29, kMostBytesPerByte = 100, kBytesPerSample = 4;

class HeaderScan {
 public:
  explicit HeaderScan(const std::filesystem::path& path)
      : path_(path), stream_(path, std::ios::binary) {
    std::error_code error_code;
    size_ = static_cast<double>(std::filesystem::file_size(path, error_code));
    if (error_code || !stream_) Fail("cannot be opened");
  }

  std::uint64_t Run() {
    if (Read<std::uint32_t>() != kMagic) FailOtherKind();
    const bool multi_part = Read<std::uint32_t>() & kMultiPartFlag;
    double offsets = 0;
    do {
      offsets += Header();
      if (offsets * kBytesPerOffset > size_) Fail("claims more chunks of pixels than it can hold");
    } while (multi_part && stream_.peek() != 0 && stream_.peek() != EOF);
    if (bytes_ > kUnaskedBytes + kMostBytesPerByte * size_)
      Fail(fmt::format("takes {:.0f} MiB of memory, more than its {:.1f} MiB can be trusted with",
                       bytes_ / 0x1p20, size_ / 0x1p20));
    if (multi_part) stream_.ignore(1);  // the empty header after the last
    return static_cast<std::uint64_t>(stream_.tellg());
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw InputError(path_.string(), problem, "make it anew with the verb that wrote it");
  }

  [[noreturn]] void FailOtherKind() const {
    const FileKind kind = WhatIs(path_);
    if (kind == FileKind::kUnknown) Fail("not an OpenEXR file");
    throw InputError(path_.string(), fmt::format("is {}, not an OpenEXR file", NameOf(kind)),
                     "name the .exr that is meant");
  }

  template <typename T>
  T Read() {
    T value{};
    stream_.read(reinterpret_cast<char*>(&value), sizeof(T));
    if (!stream_) Fail("ends within its header");
    return value;
  }

  // The least number of chunks of one part.
  double Header() {
    double chunks = 0, width = 0, height = 0, tile_width = 0, tile_height = 0, channels = 0;
    for (std::string name; std::getline(stream_, name, '\0') && !name.empty();) {
      std::string type;
      std::getline(stream_, type, '\0');
      const auto size = Read<std::int32_t>();
      const std::streamoff value_at = stream_.tellg();
      if (size < 0 || static_cast<double>(value_at) + size > size_)
        Fail(fmt::format("attribute '{}' claims {} bytes", Printable(name, 40), size));
      if (name == "dataWindow" && size == 16) {
        const auto box = Read<std::array<std::int32_t, 4>>();
        width = double{1} + box[2] - box[0];
        height = double{1} + box[3] - box[1];
        if (!(width >= 1 && height >= 1 && width * height <= kMaxExrPixelsPerPart))
          Fail(fmt::format("claims {} x {} pixels, beyond the limit of 2^28", width, height));
        if (width * height > kMostPixelsPerByte * size_)
          Fail(fmt::format("claims {} x {} pixels in {} bytes", width, height, size_));
      } else if (type == "chlist") {
        channels = Channels(size);
      } else if (name == "chunkCount" && size == 4) {
        chunks = Read<std::int32_t>();
      } else if (name == "tiles" && size == 9) {
        tile_width = Read<std::uint32_t>();
        tile_height = Read<std::uint32_t>();
        if (!(tile_width >= 1 && tile_height >= 1)) Fail("has tiles without pixels");
      } else if (type == "preview" && size >= 8) {
        const double preview_width = Read<std::uint32_t>(), preview_height = Read<std::uint32_t>();
        if (preview_width * preview_height * 4 + 8 != size)
          Fail(fmt::format("preview of {} x {} pixels has {} bytes", preview_width, preview_height,
                           size));
      }
      stream_.seekg(value_at + size);
    }
    if (!stream_) Fail("ends within its header");
    bytes_ += width * height * channels * kBytesPerSample;
    const double implied = tile_width > 0
                               ? std::ceil(width / tile_width) * std::ceil(height / tile_height)
                               : std::ceil(height / kMostLinesPerChunk);
    return std::max(chunks, implied);
  }

  // Of a list of them, each name\0 and 16 bytes.
  double Channels(std::int32_t bytes) {
    constexpr std::int32_t kFields = 16;
    double channels = 0;
    std::string name;
    for (std::int32_t at = 0; at + kFields < bytes; ++channels) {
      std::getline(stream_, name, '\0');
      stream_.ignore(kFields);
      at += static_cast<std::int32_t>(name.size()) + 1 + kFields;
      if (!stream_ || name.empty()) break;
    }
    return channels;
  }

  std::filesystem::path path_;
  std::ifstream stream_;
  double size_ = 0, bytes_ = 0;  // of the file, and of its pixels in memory
};

}  // namespace

std::uint64_t CheckExrHeaders(const std::filesystem::path& path) {
  RequireRegularFile(path);
  return HeaderScan(path).Run();
}

}  // namespace luxfield::core
