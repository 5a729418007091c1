#include "luxfield/core/exr_precheck.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/printable.h"

namespace luxfield::core {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kTiledFlag = 0x200, kNonImageFlag = 0x800, kMultiPartFlag = 0x1000;
constexpr double kBytesPerOffset = 8, kChunkHeader = 8;
// Every verb holds a file's channels in memory, some of them twice. What is measured shrinks 10
// times at best; synthetic files of one value are small.
constexpr double kUnaskedBytes = 0x1p29, kMostBytesPerByte = 100, kBytesPerSample = 4;
// The library has some tiles in memory, however small the picture is.
constexpr double kMostTileBytes = 0x1p26;

// How many scan lines a chunk has, and how many bytes of pixels a byte of the file holds at most.
// DEFLATE shrinks 1032 times at best.
struct Compression {
  double lines, most_bytes_per_byte;
};
constexpr std::array kCompressions = {
    Compression{1, 1},       // none
    Compression{1, 64},      // RLE: 2 bytes for 128
    Compression{1, 1032},    // ZIPS
    Compression{16, 1032},   // ZIP
    Compression{32, 512},    // PIZ: 10 bits for 256 values of 2 bytes
    Compression{16, 1376},   // PXR24: DEFLATE of 3 bytes in 4
    Compression{32, 11},     // B44: 3 bytes for 16 values of 2 bytes
    Compression{32, 11},     // B44A
    Compression{32, 66048},  // DWAA: DEFLATE of 2 values of 2 bytes for 64 of 4 bytes
    Compression{256, 66048}  // DWAB
};
constexpr std::uint8_t kZip = 3;  // where a header states none

// Types of one size, which the library reads whatever size is stated.
constexpr std::pair<std::int32_t, std::string_view> kSizes[] = {
    {1, " compression deepImageState envmap lineOrder "},
    {4, " float int "},
    {8, " double rational timecode v2f v2i "},
    {9, " tiledesc "},
    {12, " v3f v3i "},
    {16, " box2f box2i v2d "},
    {24, " v3d "},
    {28, " keycode "},
    {32, " chromaticities "},
    {36, " m33f "},
    {64, " m44f "},
    {72, " m33d "},
    {128, " m44d "}};
// Attributes that decide how much memory a part takes.
constexpr std::pair<std::string_view, std::string_view> kTypes[] = {{"channels", "chlist"},
                                                                    {"compression", "compression"},
                                                                    {"dataWindow", "box2i"},
                                                                    {"tiles", "tiledesc"},
                                                                    {"type", "string"}};
// Names and types; the library reads no more and takes what follows for something else.
constexpr std::size_t kLongestName = 254;

// What a header says of its part that decides how much memory it takes.
struct Part {
  double width = 0, height = 0;
  double tile_width = 0, tile_height = 0;
  std::uint8_t compression = kZip;
  std::string type;
  struct Channel {
    double bytes, x_sampling, y_sampling;
  };
  std::vector<Channel> channels;

  double BytesPerPixel() const {
    double bytes = 0;
    for (const Channel& channel : channels) bytes += channel.bytes;
    return bytes;
  }
  // In the file, before compression; less than that where channels have fewer samples.
  double PixelBytes() const {
    double bytes = 0;
    for (const Channel& channel : channels)
      bytes += channel.bytes * std::floor(width / channel.x_sampling) *
               std::floor(height / channel.y_sampling);
    return bytes;
  }
};

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
    version_ = Read<std::uint32_t>();
    const bool multi_part = version_ & kMultiPartFlag;
    do {
      Add(Header());
    } while (multi_part && stream_.peek() != 0 && stream_.peek() != EOF);
    if (multi_part) stream_.ignore(1);  // the empty header after the last
    const auto end = static_cast<std::uint64_t>(stream_.tellg());
    if (bytes_ > kUnaskedBytes + kMostBytesPerByte * size_)
      Fail(fmt::format("takes {:.0f} MiB of memory, more than its {:.1f} MiB can be trusted with",
                       bytes_ / 0x1p20, size_ / 0x1p20));
    if (packed_bytes_ > size_ - static_cast<double>(end))
      Fail(fmt::format("claims more pixels than its {} bytes can hold", size_));
    return end;
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

  [[noreturn]] void FailDeep() const {
    throw InputError(path_.string(), "holds deep pixels, or a part of no known type",
                     "flatten it to scan lines or tiles");
  }

  template <typename T>
  T Read() {
    T value{};
    stream_.read(reinterpret_cast<char*>(&value), sizeof(T));
    if (!stream_) Fail("ends within its header");
    return value;
  }

  std::string ReadText() {
    std::string text;
    std::getline(stream_, text, '\0');
    if (text.size() > kLongestName) Fail(fmt::format("has a name of {} letters", text.size()));
    return text;
  }

  // Reads a header as the library does, with which it has to agree on where each attribute ends.
  Part Header() {
    Part part;
    std::set<std::string> names;
    for (std::string name; !(name = ReadText()).empty();) {
      const std::string type = ReadText();
      const auto size = Read<std::int32_t>();
      const std::streamoff value_at = stream_.tellg();
      if (size < 0 || static_cast<double>(value_at) + size > size_)
        Fail(fmt::format("attribute '{}' claims {} bytes", Printable(name, 40), size));
      if (!names.insert(name).second)
        Fail(fmt::format("has the attribute '{}' twice", Printable(name, 40)));
      RequireType(name, type, size);
      Look(name, type, size, part);
      stream_.seekg(value_at + size);
    }
    if (!stream_) Fail("ends within its header");
    for (const char* needed : {"dataWindow", "channels"})
      if (!names.contains(needed)) Fail(fmt::format("has no {} in its header", needed));
    return part;
  }

  void RequireType(const std::string& name, const std::string& type, std::int32_t size) const {
    for (const auto& [known, its_type] : kTypes)
      if (name == known && type != its_type)
        Fail(fmt::format("attribute '{}' is of type '{}'", Printable(name, 40),
                         Printable(type, 40)));
    for (const auto& [its_size, types] : kSizes)
      if (size != its_size && types.find(" " + type + " ") != types.npos)
        Fail(fmt::format("attribute '{}' of type {} has {} bytes instead of {}",
                         Printable(name, 40), type, size, its_size));
    if (type == "floatvector" && size % 4 != 0)
      Fail(fmt::format("attribute '{}' is {} bytes of floats", Printable(name, 40), size));
    if (type == "idmanifest") FailDeep();
  }

  void Look(const std::string& name, const std::string& type, std::int32_t size, Part& part) {
    if (name == "dataWindow") {
      const auto box = Read<std::array<std::int32_t, 4>>();
      part.width = double{1} + box[2] - box[0];
      part.height = double{1} + box[3] - box[1];
      if (!(part.width >= 1 && part.height >= 1 &&
            part.width * part.height <= kMaxExrPixelsPerPart))
        Fail(fmt::format("claims {} x {} pixels, beyond the limit of 2^28", part.width,
                         part.height));
    } else if (name == "channels") {
      part.channels = Channels(size);
    } else if (name == "compression") {
      part.compression = Read<std::uint8_t>();
      if (part.compression >= kCompressions.size()) Fail("has a compression of no known kind");
    } else if (name == "tiles") {
      part.tile_width = Read<std::uint32_t>();
      part.tile_height = Read<std::uint32_t>();
      if (!(part.tile_width >= 1 && part.tile_height >= 1)) Fail("has tiles without pixels");
    } else if (name == "type") {
      part.type.resize(static_cast<std::size_t>(size));
      stream_.read(part.type.data(), size);
    } else if (type == "preview") {
      const double width = Read<std::uint32_t>(), height = Read<std::uint32_t>();
      if (width * height * 4 + 8 != size)
        Fail(fmt::format("preview of {} x {} pixels has {} bytes", width, height, size));
    }
  }

  // name\0 type, linearity and 3 unused bytes, samplings; an empty name behind the last.
  std::vector<Part::Channel> Channels(std::int32_t size) {
    std::vector<Part::Channel> channels;
    const std::streamoff end = stream_.tellg() + std::streamoff{size};
    while (!ReadText().empty()) {
      const auto type = Read<std::int32_t>();
      Read<std::int32_t>();
      const auto x_sampling = Read<std::int32_t>(), y_sampling = Read<std::int32_t>();
      if (type < 0 || type > 2 || x_sampling < 1 || y_sampling < 1)
        Fail("has a channel of no known type");
      channels.push_back({type == 1 ? 2.0 : 4.0, double(x_sampling), double(y_sampling)});
    }
    if (!stream_ || stream_.tellg() != end || channels.empty())
      Fail(fmt::format("has a list of channels that is not the {} bytes it claims", size));
    return channels;
  }

  void Add(const Part& part) {
    const bool typed = version_ & (kMultiPartFlag | kNonImageFlag);
    if (typed && part.type != "scanlineimage" && part.type != "tiledimage") FailDeep();
    const bool tiled = typed ? part.type == "tiledimage" : (version_ & kTiledFlag) != 0;
    const Compression& compression = kCompressions[part.compression];
    double chunks = std::ceil(part.height / compression.lines);
    if (tiled) {
      if (!(part.tile_width >= 1)) Fail("has no tiles in its header");
      const double tile_bytes = part.tile_width * part.tile_height * part.BytesPerPixel();
      if (tile_bytes > std::max(kMostTileBytes, part.PixelBytes()))
        Fail(fmt::format("has tiles of {} x {} pixels", part.tile_width, part.tile_height));
      chunks = std::ceil(part.width / part.tile_width) * std::ceil(part.height / part.tile_height);
    }
    chunks_ += chunks;
    if (chunks_ * (kBytesPerOffset + kChunkHeader) > size_)
      Fail("claims more chunks of pixels than it can hold");
    packed_bytes_ += chunks * (kBytesPerOffset + kChunkHeader) +
                     part.PixelBytes() / compression.most_bytes_per_byte;
    bytes_ +=
        part.width * part.height * static_cast<double>(part.channels.size()) * kBytesPerSample;
  }

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint32_t version_ = 0;
  double size_ = 0;  // of the file
  // Of all parts: chunks, the least that the file has behind the headers, what they take in memory.
  double chunks_ = 0, packed_bytes_ = 0, bytes_ = 0;
};

}  // namespace

std::uint64_t CheckExrHeaders(const std::filesystem::path& path) {
  RequireRegularFile(path);
  return HeaderScan(path).Run();
}

}  // namespace luxfield::core
