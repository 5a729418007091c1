#include "luxfield/core/exr_rows.h"

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/exr_chunks.h"
#include "luxfield/core/exr_precheck.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {

struct ExrRowReader::Impl {
  const ExrReader& reader;
  Imf::MultiPartInputFile file;
  ExrChunks chunks;

  explicit Impl(const ExrReader& of)
      : reader(of),
        file(of.path().c_str(), Threads()),
        chunks(of.path(), Headers(file), CheckExrHeaders(of.path())) {}

  static std::vector<const Imf::Header*> Headers(const Imf::MultiPartInputFile& file) {
    std::vector<const Imf::Header*> headers;
    for (int part = 0; part < file.parts(); ++part) headers.push_back(&file.header(part));
    return headers;
  }

  void Read(int part_index, Imf::PixelType type, std::span<const std::string> channels,
            std::span<void* const> pixels, int first, int count) {
    const ExrReader::Part& part = reader.parts().at(part_index);
    std::vector<ExrPlane> planes;
    for (std::size_t i = 0; i < channels.size(); ++i)
      planes.push_back({channels[i], type == Imf::UINT, pixels[i]});
    if (chunks.Read(part_index, planes, first, count)) return;
    try {
      const auto& window = file.header(part_index).dataWindow();
      const int top = window.min.y + first;
      Imf::FrameBuffer buffer;
      for (std::size_t i = 0; i < channels.size(); ++i) {
        if (!reader.has_channel(part_index, channels[i]))
          throw InputError(reader.path().string(),
                           fmt::format("part '{}' has no channel '{}'", part.name, channels[i]),
                           "check that this is the kind of file the verb expects");
        // OpenEXR addresses pixels by data-window coordinates.
        char* base = static_cast<char*>(pixels[i]) -
                     4 * (static_cast<std::ptrdiff_t>(top) * part.width + window.min.x);
        buffer.insert(channels[i], Imf::Slice(type, base, 4, std::size_t{4} * part.width));
      }
      Imf::InputPart input(file, part_index);
      input.setFrameBuffer(buffer);
      input.readPixels(top, top + count - 1);
    } catch (const Error&) {
      throw;
    } catch (const std::exception&) {
      throw InputError(reader.path().string(),
                       fmt::format("rows {} to {} of part '{}' cannot be read", first,
                                   first + count - 1, part.name),
                       "the file is truncated or damaged: make it anew");
    }
  }
};

ExrRowReader::ExrRowReader(const ExrReader& reader) : impl_(std::make_unique<Impl>(reader)) {}
ExrRowReader::~ExrRowReader() = default;

void ExrRowReader::ReadFloats(int part, std::span<const std::string> channels,
                              std::span<const std::span<float>> pixels, int first, int count) {
  std::vector<void*> pointers;
  for (const std::span<float> plane : pixels) pointers.push_back(plane.data());
  impl_->Read(part, Imf::FLOAT, channels, pointers, first, count);
}

std::vector<std::uint32_t> ExrRowReader::ReadUint(int part, const std::string& channel, int first,
                                                  int count) {
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(impl_->reader.parts().at(part).width) *
                                    count);
  void* pointer = pixels.data();
  impl_->Read(part, Imf::UINT, std::span(&channel, 1), std::span(&pointer, 1), first, count);
  return pixels;
}

}  // namespace luxfield::core
