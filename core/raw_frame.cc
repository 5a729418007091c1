#include "core/raw_frame.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "core/frame_file.h"

namespace luxfield::core {
namespace {

// A file in memory for libtiff: frames are hashed and written by our own code, which reports a full
// disk.
struct MemoryFile {
  std::string written;
  std::string_view read;
  std::uint64_t position = 0;
  bool writing = false;

  std::uint64_t size() const { return writing ? written.size() : read.size(); }
};

tmsize_t ReadMemory(thandle_t handle, void* buffer, tmsize_t size) {
  auto& file = *static_cast<MemoryFile*>(handle);
  const std::string_view bytes = file.writing ? std::string_view(file.written) : file.read;
  if (file.position >= bytes.size() || size <= 0) return 0;
  const std::size_t count =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(size), bytes.size() - file.position);
  std::memcpy(buffer, bytes.data() + file.position, count);
  file.position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t WriteMemory(thandle_t handle, void* buffer, tmsize_t size) {
  auto& file = *static_cast<MemoryFile*>(handle);
  if (!file.writing || size < 0) return -1;
  const auto count = static_cast<std::size_t>(size);
  if (file.written.size() < file.position + count) file.written.resize(file.position + count);
  std::memcpy(file.written.data() + file.position, buffer, count);
  file.position += count;
  return size;
}

toff_t SeekMemory(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<MemoryFile*>(handle);
  if (whence == SEEK_SET) file.position = offset;
  if (whence == SEEK_CUR) file.position += offset;
  if (whence == SEEK_END) file.position = file.size() + offset;
  return file.position;
}

int CloseMemory(thandle_t) { return 0; }
toff_t SizeOfMemory(thandle_t handle) { return static_cast<MemoryFile*>(handle)->size(); }

using TiffFile = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

TiffFile Open(MemoryFile& file, const std::string& name, const char* mode) {
  // libtiff prints to stderr by default; every failure here becomes one InputError instead.
  [[maybe_unused]] static const auto silent =
      (TIFFSetWarningHandler(nullptr), TIFFSetErrorHandler(nullptr));
  return TiffFile(TIFFClientOpen(name.c_str(), mode, &file, &ReadMemory, &WriteMemory, &SeekMemory,
                                 &CloseMemory, &SizeOfMemory, nullptr, nullptr),
                  &TIFFClose);
}

// All samples, interleaved, into one plane of `pixels`; returns how many a pixel has.
int ReadPixels(std::string_view bytes, const std::string& file, RawFrame* pixels) {
  const auto fail = [&](const std::string& problem) {
    throw InputError(file, problem,
                     "restore the frame, or run `luxfield verify --salvage` on its session");
  };
  MemoryFile memory;
  memory.read = bytes;
  const TiffFile tiff = Open(memory, file, "rm");
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
  if (width == 0 || height == 0 || width > 65536 || height > 65536 || needed > bytes.size())
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

std::string EncodeTiff(const RawFrame& frame) {
  const bool is_float = !frame.value.empty();
  const std::size_t count = is_float ? frame.value.size() : frame.dn.size();
  if (frame.width < 1 || frame.height < 1 || count != frame.size())
    throw DeviceError(
        fmt::format("a frame of {} x {} pixels came with {} values; the camera driver is at fault",
                    frame.width, frame.height, count));
  MemoryFile memory;
  memory.writing = true;
  {
    const TiffFile tiff = Open(memory, "frame", "wlm");  // classic little-endian, no memory map
    if (!tiff) throw DeviceError("libtiff cannot create an image in memory; free memory");
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, frame.width);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, frame.height);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, is_float ? 32 : 16);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT,
                 is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, frame.height);
    // libtiff takes a mutable buffer because it may swap bytes in place; it does not here.
    void* pixels = is_float ? static_cast<void*>(const_cast<float*>(frame.value.data()))
                            : static_cast<void*>(const_cast<std::uint16_t*>(frame.dn.data()));
    const auto bytes = static_cast<tmsize_t>(count * (is_float ? 4 : 2));
    if (TIFFWriteEncodedStrip(tiff.get(), 0, pixels, bytes) != bytes ||
        TIFFWriteDirectory(tiff.get()) != 1)
      throw DeviceError("libtiff cannot encode a frame; free memory");
  }
  return std::move(memory.written);
}

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

}  // namespace luxfield::core
