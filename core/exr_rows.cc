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
  std::uint64_t tables_at;
  Imf::MultiPartInputFile file;
  ExrChunks chunks;

  explicit Impl(const ExrReader& of)
      : reader(of),
        tables_at(CheckExrHeaders(of.path())),
        file(of.path().c_str(), Threads()),
        chunks(of.path(), Headers(file), tables_at) {}

  static std::vector<const Imf::Header*> Headers(const Imf::MultiPartInputFile& file) {
    std::vector<const Imf::Header*> headers;
    for (int part = 0; part < file.parts(); ++part) headers.push_back(&file.header(part));
    return headers;
  }

  void Read(int part_index, std::span<const ExrTarget> targets, int first, int count) {
    const ExrReader::Part& part = reader.parts().at(part_index);
    if (chunks.Read(part_index, targets, first, count)) return;
    try {
      const auto& window = file.header(part_index).dataWindow();
      const int top = window.min.y + first;
      Imf::FrameBuffer buffer;
      for (const ExrTarget& target : targets) {
        if (!reader.has_channel(part_index, target.channel))
          throw InputError(reader.path().string(),
                           fmt::format("part '{}' has no channel '{}'", part.name, target.channel),
                           "check that this is the kind of file the verb expects");
        // OpenEXR addresses pixels by data-window coordinates.
        char* base =
            BytesOf(target) - 4 * (static_cast<std::ptrdiff_t>(top) * part.width + window.min.x);
        buffer.insert(target.channel, Imf::Slice(IsUint(target) ? Imf::UINT : Imf::FLOAT, base, 4,
                                                 std::size_t{4} * part.width));
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

void ExrRowReader::Read(int part, std::span<const ExrTarget> targets, int first, int count) {
  impl_->Read(part, targets, first, count);
}

}  // namespace luxfield::core
