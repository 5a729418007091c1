#include "luxfield/session/frame_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/sha256.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/session_path.h"

namespace luxfield::session {
namespace {

std::filesystem::path FrameFile(const SessionReader& session, const FrameRecord& record) {
  return SessionFile(session.folder(), record.file, session.folder().string());
}

void ReadInto(const std::filesystem::path& path, std::string* bytes) {
  bytes->clear();
  std::error_code unknown;  // the size is only a hint
  if (const auto size = std::filesystem::file_size(path, unknown); !unknown) bytes->reserve(size);
  core::ReadInPieces(path, [&](std::string_view piece) { bytes->append(piece); });
}

// As many at a time as are hashed together.
void CheckHashes(const SessionReader& session, std::span<const FrameRecord* const> records,
                 std::span<const std::string> bytes) {
  core::ParallelFor(
      records.size(), core::Sha256Together(records.size()),
      [&](std::size_t begin, std::size_t end) {
        std::vector<core::Sha256Message> messages;
        for (std::size_t n = begin; n < end; ++n) messages.push_back({{}, bytes[n]});
        const auto hashes = core::Sha256OfEach(messages);
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
  for_each([&](std::size_t n) { ReadInto(FrameFile(session, *records[n]), &bytes[n]); });
  if (check_hashes) CheckHashes(session, records, bytes);
  const std::optional<SensorSize> sensor = StatedSize(session);
  for_each([&](std::size_t n) {
    const std::string file = FrameFile(session, *records[n]).string();
    DecodeTiff(bytes[n], file, &frames[n]);
    if (sensor) RequireSize(frames[n], *sensor, file);
  });
}

}  // namespace luxfield::session
