#include "luxfield/session/frame_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/sha256.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/session_path.h"

namespace luxfield::session {
namespace {

std::filesystem::path FrameFile(const SessionReader& session, const FrameRecord& record) {
  return SessionFile(session.folder(), record.file, session.folder().string());
}

// Reads a file as EncodeTiff writes it, its pixels to their place and the head alone into `bytes`:
// true. Of any other all bytes, to be decoded: false.
bool ReadInto(const std::filesystem::path& path, std::string* bytes, RawFrame* frame) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;  // of a file that does not tell its size
  core::InputStream file(path);
  bytes->resize(kTiffHeadBytes);
  bytes->resize(file.Read(*bytes));
  const auto size = file.size();
  if (size && ShapeByHead(*bytes, *size, frame)) {
    char* const pixels = const_cast<char*>(PixelBytes(*frame).data());
    const std::size_t wanted = PixelBytes(*frame).size(), count = file.Read({pixels, wanted});
    if (count == wanted) return true;
    bytes->append(pixels, count);
    return false;
  }
  for (std::size_t filled = bytes->size();;) {
    bytes->resize(size && *size > filled ? *size : filled + kPiece);
    const std::size_t count = file.Read(std::span(*bytes).subspan(filled));
    filled += count;
    if (filled < bytes->size()) {
      bytes->resize(filled);
      return false;
    }
  }
}

// A frame's file as it was read.
core::Sha256Message Message(bool in_place, std::string_view bytes, const RawFrame& frame) {
  return in_place ? core::Sha256Message{bytes, PixelBytes(frame)} : core::Sha256Message{{}, bytes};
}

// As many at a time as are hashed together.
void CheckHashes(const SessionReader& session, std::span<const FrameRecord* const> records,
                 std::span<const core::Sha256Message> messages) {
  core::ParallelFor(
      records.size(), core::Sha256Together(records.size()),
      [&](std::size_t begin, std::size_t end) {
        const auto hashes = core::Sha256OfEach(messages.subspan(begin, end - begin));
        for (std::size_t n = begin; n < end; ++n)
          if (hashes[n - begin] != records[n]->sha256)
            throw InputError(
                FrameFile(session, *records[n]).string(),
                "differs from the frame that was committed (SHA-256)",
                "restore it from a copy, or run `luxfield verify --salvage` on the session");
      });
}

void RequireSize(const RawFrame& frame, SensorSize sensor, const std::string& file) {
  if (frame.width != sensor.width || frame.height != sensor.height)
    throw InputError(file,
                     fmt::format("has {} x {} pixels, the session's camera has {} x {}",
                                 frame.width, frame.height, sensor.width, sensor.height),
                     "restore the frame from a copy of the session");
}

}  // namespace

void ReadFrame(const SessionReader& session, const FrameRecord& record, bool check_hash,
               std::string* bytes, RawFrame* frame) {
  const FrameRecord* const records[] = {&record};
  ReadFrames(session, records, check_hash, {bytes, 1}, {frame, 1});
}

void ReadFrames(const SessionReader& session, std::span<const FrameRecord* const> records,
                bool check_hashes, std::span<std::string> bytes, std::span<RawFrame> frames) {
  const auto for_each = [&](const auto& body) {
    core::ParallelFor(records.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) body(n);
    });
  };
  std::vector<char> in_place(records.size());
  for_each([&](std::size_t n) {
    in_place[n] = ReadInto(FrameFile(session, *records[n]), &bytes[n], &frames[n]);
  });
  if (check_hashes) {
    std::vector<core::Sha256Message> messages;
    for (std::size_t n = 0; n < records.size(); ++n)
      messages.push_back(Message(in_place[n], bytes[n], frames[n]));
    CheckHashes(session, records, messages);
  }
  const std::optional<SensorSize> sensor = StatedSize(session);
  for_each([&](std::size_t n) {
    const std::string file = FrameFile(session, *records[n]).string();
    if (!in_place[n]) DecodeTiff(bytes[n], file, &frames[n]);
    if (sensor) RequireSize(frames[n], *sensor, file);
  });
}

}  // namespace luxfield::session
