// Pixels of OpenEXR files of scan lines, read and written past the library, which takes several times
// as long: what our files hold and nothing else. Internal to core/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/exr.h"

namespace Imf_3_1 {
class Header;
}

namespace luxfield::core {

class ExrZipper;

inline bool IsUint(const ExrTarget& target) { return target.pixels.index() == 1; }
inline char* BytesOf(const ExrTarget& target) {
  return std::visit([](const auto& pixels) { return reinterpret_cast<char*>(pixels.data()); },
                    target.pixels);
}

// Reads a file whose headers the library has read and CheckExrHeaders passed. The file is read by
// pread, not mapped: one that changes or shrinks meanwhile gives other bytes, not a signal.
class ExrChunks {
 public:
  // `headers`: of all parts. `tables_at`: where the tables of offsets begin.
  ExrChunks(const std::filesystem::path& path, std::span<const Imf_3_1::Header* const> headers,
            std::uint64_t tables_at);
  ~ExrChunks();

  // Rows first to first + rows - 1 of a part, on several threads. False where that cannot be done
  // here, and then the library is to be asked, which says what is wrong, if anything is: parts of
  // tiles, compressions other than ZIP, ZIPS and none, channels of another type, and whatever is
  // damaged. The targets then hold anything.
  bool Read(int part, std::span<const ExrTarget> targets, int first, int rows) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

constexpr int kZipRows = 16;  // in a chunk of ZIP_COMPRESSION; the last has those that are left
inline std::size_t ZipChunks(int rows) {
  return (static_cast<std::size_t>(rows) + kZipRows - 1) / kZipRows;
}

// Packs the content of such a chunk: rows first to first + rows - 1 of planes in the order of the
// channels' names. Valid until the next call. Not for several threads at once.
class ExrRowPacker {
 public:
  ExrRowPacker(int width, std::size_t planes);
  ~ExrRowPacker();
  ExrRowPacker(const ExrRowPacker&) = delete;
  ExrRowPacker& operator=(const ExrRowPacker&) = delete;
  std::span<const unsigned char> Pack(std::span<const unsigned char* const> planes, int first,
                                      int rows);

 private:
  int width_;
  std::vector<unsigned char> block_;
  std::unique_ptr<ExrZipper> zipper_;
};

// The planes of a part's channels in the order of the channels' names.
std::vector<const unsigned char*> PlanesByName(const ExrPartView& part,
                                               std::span<const ExrPixels> pixels);

// Writes the pixels of a file whose headers, of ZIP_COMPRESSION and scan lines, the library has
// written, with room for the tables of offsets as its end. Throws DeviceError naming `path`.
class ExrZipWriter {
 public:
  ExrZipWriter(const std::filesystem::path& path, const std::filesystem::path& temporary,
               std::span<const ExrPartView> parts);
  ~ExrZipWriter();

  // The next part; its channels' pixels in the order in which it names them.
  void Add(const ExrPartView& part, std::span<const ExrPixels> pixels);
  // The next part, whose chunks are packed already: content(chunk) is called for each in order.
  void AddPacked(const ExrPartView& part,
                 const std::function<std::span<const unsigned char>(std::size_t chunk)>& content);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// WriteExr (exr.h), kZip, of chunks that are packed: content(part, chunk) is called for each in
// order.
void WriteExrPacked(
    const std::filesystem::path& path, std::span<const ExrPartView> parts,
    const std::function<std::span<const unsigned char>(int part, std::size_t chunk)>& content);

}  // namespace luxfield::core
