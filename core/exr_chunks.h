// Pixels of OpenEXR files of scan lines, read and written past the library, which takes several times
// as long: what our files hold and nothing else. Internal to core/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/exr.h"

namespace Imf_3_1 {
class Header;
}

namespace luxfield::core {

// A channel of a part to read: FLOAT or UINT as `is_uint` says, pixels of width x rows x 4 bytes.
struct ExrPlane {
  std::string channel;
  bool is_uint = false;
  void* pixels = nullptr;
};

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
  // damaged. The planes then hold anything.
  bool Read(int part, std::span<const ExrPlane> planes, int first, int rows) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Writes the pixels of a file whose headers, of ZIP_COMPRESSION and scan lines, the library has
// written, with room for the tables of offsets as its end. Throws DeviceError naming `path`.
class ExrZipWriter {
 public:
  ExrZipWriter(const std::filesystem::path& path, const std::filesystem::path& temporary,
               std::span<const ExrPartView> parts);
  ~ExrZipWriter();

  // The next part; its channels' pixels in the order in which it names them.
  void Add(const ExrPartView& part, std::span<const ExrPixels> pixels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::core
