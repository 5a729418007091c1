#include "luxfield/reconstruct/calibrate/response/exif.h"

#include <cstdint>

namespace luxfield::reconstruct {
namespace {

using namespace std::string_view_literals;

// A TIFF structure: numbers in the byte order that its head names, 0 outside of it.
class TiffBytes {
 public:
  explicit TiffBytes(std::string_view bytes)
      : bytes_(bytes), big_endian_(bytes.starts_with("MM"sv)) {}

  std::uint32_t Number(std::size_t offset, int size) const {
    if (offset > bytes_.size() || bytes_.size() - offset < static_cast<std::size_t>(size)) return 0;
    std::uint32_t value = 0;
    for (int k = 0; k < size; ++k) {
      const auto byte =
          static_cast<unsigned char>(bytes_[offset + (big_endian_ ? k : size - 1 - k)]);
      value = value << 8 | byte;
    }
    return value;
  }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

constexpr int kShort = 3, kLong = 4, kRational = 5;
constexpr std::uint32_t kExifFolder = 0x8769;

std::optional<double> Value(const TiffBytes& tiff, std::size_t entry) {
  const std::uint32_t type = tiff.Number(entry + 2, 2);
  double value = 0;
  if (type == kShort) value = tiff.Number(entry + 8, 2);
  if (type == kLong) value = tiff.Number(entry + 8, 4);
  if (type == kRational) {
    const std::size_t at = tiff.Number(entry + 8, 4);
    const double denominator = tiff.Number(at + 4, 4);
    if (denominator > 0) value = tiff.Number(at, 4) / denominator;
  }
  if (value > 0) return value;
  return {};
}

// Reads a directory's entries and returns where its Exif directory is, 0 if it names none.
std::size_t ReadFolder(const TiffBytes& tiff, std::size_t folder, ExifExposure* exif) {
  std::size_t exif_folder = 0;
  const std::uint32_t entries = tiff.Number(folder, 2);
  for (std::uint32_t k = 0; k < entries; ++k) {
    const std::size_t entry = folder + 2 + 12 * std::size_t{k};
    const std::uint32_t tag = tiff.Number(entry, 2);
    if (tag == kExifFolder) exif_folder = tiff.Number(entry + 8, 4);
    if (tag == 0x829A) exif->exposure_s = Value(tiff, entry);
    if (tag == 0x829D) exif->f_number = Value(tiff, entry);
    if (tag == 0x8827) exif->iso = Value(tiff, entry);
  }
  return exif_folder;
}

ExifExposure FromTiff(std::string_view bytes) {
  ExifExposure exif;
  const TiffBytes tiff(bytes);
  const std::size_t first = tiff.Number(4, 4);
  if (first == 0) return exif;
  if (const std::size_t folder = ReadFolder(tiff, first, &exif)) ReadFolder(tiff, folder, &exif);
  return exif;
}

std::size_t BigEndian(std::string_view file, std::size_t at, int size) {
  std::size_t value = 0;
  for (int k = 0; k < size; ++k) value = value << 8 | static_cast<unsigned char>(file[at + k]);
  return value;
}

ExifExposure FromJpeg(std::string_view file) {
  constexpr auto kHead = "Exif\0\0"sv;
  // Segments: FF, marker, length with itself; the picture's data begin at FF DA.
  std::size_t at = 2;
  while (at + 4 <= file.size() && file[at] == '\xFF' && file[at + 1] != '\xDA') {
    const std::size_t length = BigEndian(file, at + 2, 2);
    const std::string_view segment = file.substr(at + 4, length < 2 ? 0 : length - 2);
    if (file[at + 1] == '\xE1' && segment.starts_with(kHead))
      return FromTiff(segment.substr(kHead.size()));
    at += 2 + length;
  }
  return {};
}

ExifExposure FromPng(std::string_view file) {
  // Chunks: length of the data, name, data, CRC.
  for (std::size_t at = 8; at + 12 <= file.size();) {
    const std::size_t length = BigEndian(file, at, 4);
    if (file.substr(at + 4, 4) == "eXIf"sv) return FromTiff(file.substr(at + 8, length));
    at += 12 + length;
  }
  return {};
}

}  // namespace

ExifExposure ReadExif(std::string_view file) {
  if (file.starts_with("\xFF\xD8"sv)) return FromJpeg(file);
  if (file.starts_with("\x89PNG\r\n\x1a\n"sv)) return FromPng(file);
  if (file.starts_with("II*\0"sv) || file.starts_with("MM\0*"sv)) return FromTiff(file);
  return {};
}

}  // namespace luxfield::reconstruct
