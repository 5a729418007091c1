// OpenEXR files: multi-part, FLOAT and UINT channels, typed attributes. HALF is read, never
// written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "luxfield/core/image.h"

namespace luxfield::core {

using ExrValue = std::variant<int, double, std::string>;
using ExrAttributes = std::map<std::string, ExrValue>;

// A channel's pixels, row-major, width x height.
using ExrPixels = std::variant<std::span<const float>, std::span<const std::uint32_t>>;

// A channel to read, and where its pixels go: all that are asked for, row-major.
struct ExrTarget {
  std::string channel;
  std::variant<std::span<float>, std::span<std::uint32_t>> pixels;
};

// A channel to write; the pixels stay the caller's and are not copied.
struct ExrChannelView {
  std::string name;
  ExrPixels pixels;
};

struct ExrPartView {
  std::string name;  // unique; may be empty when it is the only part
  int width = 0;
  int height = 0;
  std::vector<ExrChannelView> channels;
  ExrAttributes attributes;
};

enum class ExrCompression { kNone, kZip };  // kZip: about 40 MB/s a core; kNone: the disk's speed

// Writes all parts atomically (core/file.h). The bytes depend on the arguments only: no clock, no
// host name. Throws DeviceError.
void WriteExr(const std::filesystem::path& path, std::span<const ExrPartView> parts,
              ExrCompression compression = ExrCompression::kZip);
// The same for parts whose pixels are made one part at a time: those of `parts` only say the type,
// and pixels(part) is called once for each, in order; what it returns is read until the next call.
// What it throws is passed on, and no file is left.
void WriteExr(const std::filesystem::path& path, std::span<const ExrPartView> parts,
              ExrCompression compression,
              const std::function<std::vector<ExrPixels>(int part)>& pixels);

// An open file. Every error (missing, not EXR, truncated, wrong channel type) is an InputError
// naming the file.
class ExrReader {
 public:
  explicit ExrReader(const std::filesystem::path& path);
  ~ExrReader();
  ExrReader(ExrReader&&) noexcept;
  ExrReader& operator=(ExrReader&&) noexcept;

  struct Part {
    std::string name;
    int width = 0;
    int height = 0;
    std::vector<std::string> channels;  // sorted as in the file
    std::vector<bool> channel_is_uint;
    // int, float/double and string attributes; an envmap as "latlong", "cube" or "unknown (N)",
    // chromaticities as x and y of red, green, blue and white, spaced; others are left out.
    ExrAttributes attributes;
  };
  const std::vector<Part>& parts() const;
  const std::filesystem::path& path() const;
  int find_part(const std::string& name) const;  // -1 if absent
  bool has_channel(int part, const std::string& channel) const;

  // One channel of one part; HALF and FLOAT become float.
  std::vector<float> ReadFloat(int part, const std::string& channel);
  void ReadFloat(int part, const std::string& channel, std::span<float> pixels);
  // Several channels in one pass over the part's bytes, which are read and unpacked whole whatever is
  // asked for.
  void Read(int part, std::span<const ExrTarget> targets);
  std::vector<std::uint32_t> ReadUint(int part, const std::string& channel);

  // Attributes of a part; InputError if absent or of another type (int is accepted as double).
  int GetInt(int part, const std::string& name) const;
  double GetDouble(int part, const std::string& name) const;
  std::string GetString(int part, const std::string& name) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A plain picture: channels R, G, B (or Y) of the first part.
Image ReadExrImage(const std::filesystem::path& path);
// 1 channel is written as Y, 3 as R, G, B.
void WriteExrImage(const std::filesystem::path& path, const Image& image,
                   const ExrAttributes& attributes = {});

}  // namespace luxfield::core
