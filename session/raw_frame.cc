#include "luxfield/session/raw_frame.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>

#include "luxfield/core/error.h"
#include "luxfield/core/sha256.h"
#include "luxfield/session/frame_file.h"

namespace luxfield::session {
namespace {

// A file in memory for libtiff.
struct MemoryFile {
  std::string_view bytes;
  std::uint64_t position = 0;
};

tmsize_t ReadMemory(thandle_t handle, void* buffer, tmsize_t size) {
  auto& file = *static_cast<MemoryFile*>(handle);
  if (file.position >= file.bytes.size() || size <= 0) return 0;
  const std::size_t count =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(size), file.bytes.size() - file.position);
  std::memcpy(buffer, file.bytes.data() + file.position, count);
  file.position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t WriteNothing(thandle_t, void*, tmsize_t) { return -1; }

toff_t SeekMemory(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<MemoryFile*>(handle);
  if (whence == SEEK_SET) file.position = offset;
  if (whence == SEEK_CUR) file.position += offset;
  if (whence == SEEK_END) file.position = file.bytes.size() + offset;
  return file.position;
}

int CloseMemory(thandle_t) { return 0; }
toff_t SizeOfMemory(thandle_t handle) { return static_cast<MemoryFile*>(handle)->bytes.size(); }

using TiffFile = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

TiffFile Open(MemoryFile& file, const std::string& name) {
  // libtiff prints to stderr by default; every failure here becomes one InputError instead.
  [[maybe_unused]] static const auto silent =
      (TIFFSetWarningHandler(nullptr), TIFFSetErrorHandler(nullptr));
  return TiffFile(TIFFClientOpen(name.c_str(), "rm", &file, &ReadMemory, &WriteNothing, &SeekMemory,
                                 &CloseMemory, &SizeOfMemory, nullptr, nullptr),
                  &TIFFClose);
}

struct TiffField {
  std::uint16_t tag, type;
  std::uint32_t value;  // of one; little-endian, a SHORT is the first half of a LONG
};

void AppendLittleEndian(std::string& to, std::uint64_t value, int bytes) {
  for (int n = 0; n < bytes; ++n) to += static_cast<char>(value >> (8 * n));
}

constexpr std::uint32_t kDirectory = 8, kFirstField = kDirectory + 2;  // where they begin
constexpr std::uint32_t kFieldBytes = 12, kFieldValue = 8;             // of a field; into it
constexpr std::uint32_t kMostPixels = 65536;                           // along an axis

std::uint32_t LittleEndian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t n = 4; n-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + n]);
  return value;
}

// The head of a frame whose pixels fit the file.
std::string HeadOf(std::uint32_t width, std::uint32_t height, bool is_float) {
  const std::uint32_t bytes = width * height * (is_float ? 4u : 2u);
  // Ascending by tag, as TIFF 6.0 asks.
  const TiffField fields[] = {
      {TIFFTAG_IMAGEWIDTH, TIFF_LONG, width},
      {TIFFTAG_IMAGELENGTH, TIFF_LONG, height},
      {TIFFTAG_BITSPERSAMPLE, TIFF_SHORT, is_float ? 32u : 16u},
      {TIFFTAG_COMPRESSION, TIFF_SHORT, COMPRESSION_NONE},
      {TIFFTAG_PHOTOMETRIC, TIFF_SHORT, PHOTOMETRIC_MINISBLACK},
      {TIFFTAG_STRIPOFFSETS, TIFF_LONG, kTiffHeadBytes},
      {TIFFTAG_SAMPLESPERPIXEL, TIFF_SHORT, 1},
      {TIFFTAG_ROWSPERSTRIP, TIFF_LONG, height},
      {TIFFTAG_STRIPBYTECOUNTS, TIFF_LONG, bytes},
      {TIFFTAG_PLANARCONFIG, TIFF_SHORT, PLANARCONFIG_CONTIG},
      {TIFFTAG_SAMPLEFORMAT, TIFF_SHORT,
       static_cast<std::uint32_t>(is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT)},
  };
  std::string head = "II";
  AppendLittleEndian(head, 42, 2);
  AppendLittleEndian(head, kDirectory, 4);
  AppendLittleEndian(head, std::size(fields), 2);
  for (const TiffField& field : fields) {
    AppendLittleEndian(head, field.tag, 2);
    AppendLittleEndian(head, field.type, 2);
    AppendLittleEndian(head, 1, 4);
    AppendLittleEndian(head, field.value, 4);
  }
  head.resize(kTiffHeadBytes);  // no further directory, and zeros up to the pixels
  return head;
}

// All samples, interleaved, into one plane of `pixels`; returns how many a pixel has.
int ReadPixels(std::string_view bytes, const std::string& file, RawFrame* pixels) {
  const auto fail = [&](const std::string& problem) {
    throw InputError(file, problem,
                     "restore the frame, or run `luxfield verify --salvage` on its session");
  };
  MemoryFile memory{bytes};
  const TiffFile tiff = Open(memory, file);
  if (!tiff) fail("is not a TIFF file or is truncated");
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, samples = 1, format = SAMPLEFORMAT_UINT, compression = COMPRESSION_NONE,
                planes = PLANARCONFIG_CONTIG;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_COMPRESSION, &compression);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &planes);
  const bool is_float = format == SAMPLEFORMAT_IEEEFP && bits == 32;
  if ((samples != 1 && samples != 3) || planes != PLANARCONFIG_CONTIG ||
      compression != COMPRESSION_NONE || TIFFIsTiled(tiff.get()) ||
      !(is_float || (format == SAMPLEFORMAT_UINT && bits == 16)))
    fail(
        fmt::format("has {} samples of {} bits, format {}, compression {}; frames are one "
                    "uncompressed channel, or three, of 16-bit "
                    "unsigned or 32-bit float samples",
                    samples, bits, format, compression));
  const std::uint64_t needed = std::uint64_t{width} * height * samples * (is_float ? 4u : 2u);
  if (width == 0 || height == 0 || width > kMostPixels || height > kMostPixels ||
      needed > bytes.size())
    fail(fmt::format("claims {} x {} pixels but holds {} bytes", width, height, bytes.size()));

  pixels->width = static_cast<int>(width);
  pixels->height = static_cast<int>(height);
  pixels->dn.resize(is_float ? 0 : needed / 2);
  pixels->value.resize(is_float ? needed / 4 : 0);
  char* const target = is_float ? reinterpret_cast<char*>(pixels->value.data())
                                : reinterpret_cast<char*>(pixels->dn.data());
  std::uint64_t filled = 0;
  for (std::uint32_t strip = 0; strip < TIFFNumberOfStrips(tiff.get()) && filled < needed;
       ++strip) {
    const tmsize_t count = TIFFReadEncodedStrip(tiff.get(), strip, target + filled,
                                                static_cast<tmsize_t>(needed - filled));
    if (count <= 0) break;
    filled += static_cast<std::uint64_t>(count);
  }
  if (filled != needed) fail(fmt::format("is truncated: {} of {} bytes of pixels", filled, needed));
  return samples;
}

}  // namespace

std::string TiffHead(const RawFrame& frame) {
  const bool is_float = !frame.value.empty();
  const std::size_t count = is_float ? frame.value.size() : frame.dn.size();
  if (frame.width < 1 || frame.height < 1 || count != frame.size())
    throw DeviceError(
        fmt::format("a frame of {} x {} pixels came with {} values; the camera driver is at fault",
                    frame.width, frame.height, count));
  const std::size_t bytes = PixelBytes(frame).size();
  if (bytes > std::numeric_limits<std::uint32_t>::max() - kTiffHeadBytes)
    throw DeviceError(fmt::format(
        "a frame of {} x {} pixels does not fit a TIFF file (4 GiB); choose a smaller region",
        frame.width, frame.height));
  return HeadOf(static_cast<std::uint32_t>(frame.width), static_cast<std::uint32_t>(frame.height),
                is_float);
}

bool ShapeByHead(std::string_view head, std::uintmax_t file_bytes, RawFrame* frame) {
  if (head.size() != kTiffHeadBytes) return false;
  const std::uint32_t width = LittleEndian(head, kFirstField + kFieldValue),
                      height = LittleEndian(head, kFirstField + kFieldBytes + kFieldValue);
  for (const bool is_float : {false, true}) {
    const std::uint64_t pixels = std::uint64_t{width} * height;
    if (width > kMostPixels || height > kMostPixels ||
        file_bytes != kTiffHeadBytes + pixels * (is_float ? 4 : 2) ||
        head != HeadOf(width, height, is_float))
      continue;
    frame->width = static_cast<int>(width);
    frame->height = static_cast<int>(height);
    frame->dn.resize(is_float ? 0 : pixels);
    frame->value.resize(is_float ? pixels : 0);
    return pixels > 0;
  }
  return false;
}

std::string_view PixelBytes(const RawFrame& frame) {
  static_assert(std::endian::native == std::endian::little, "pixels are stored as they are");
  if (!frame.value.empty())
    return {reinterpret_cast<const char*>(frame.value.data()), frame.value.size() * sizeof(float)};
  return {reinterpret_cast<const char*>(frame.dn.data()), frame.dn.size() * sizeof(std::uint16_t)};
}

std::string EncodeTiff(const RawFrame& frame) { return TiffHead(frame).append(PixelBytes(frame)); }

RawFrame DecodeTiff(std::string_view bytes, const std::string& file) {
  RawFrame frame;
  DecodeTiff(bytes, file, &frame);
  return frame;
}

void DecodeTiff(std::string_view bytes, const std::string& file, RawFrame* frame) {
  if (ReadPixels(bytes, file, frame) != 1)
    throw InputError(file, "has 3 samples a pixel; frames are one channel",
                     "restore the frame, or run `luxfield verify --salvage` on its session");
}

std::vector<RawFrame> DecodeTiffChannels(std::string_view bytes, const std::string& file) {
  RawFrame pixels;
  const auto samples = static_cast<std::size_t>(ReadPixels(bytes, file, &pixels));
  std::vector<RawFrame> channels;
  if (samples == 1) {
    channels.push_back(std::move(pixels));
    return channels;
  }
  for (std::size_t c = 0; c < samples; ++c) {
    RawFrame& frame = channels.emplace_back();
    frame.width = pixels.width;
    frame.height = pixels.height;
    for (std::size_t k = c; k < pixels.dn.size(); k += samples) frame.dn.push_back(pixels.dn[k]);
    for (std::size_t k = c; k < pixels.value.size(); k += samples)
      frame.value.push_back(pixels.value[k]);
  }
  return channels;
}

}  // namespace luxfield::session
