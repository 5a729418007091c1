#include "core/frame_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "core/error.h"
#include "core/file.h"
#include "core/json.h"
#include "core/parallel.h"
#include "core/session_path.h"
#include "core/sha256.h"

namespace luxfield::core {
namespace {

std::filesystem::path FrameFile(const SessionReader& session, const FrameRecord& record) {
  return SessionFile(session.folder(), record.file, session.folder().string());
}

void ReadInto(const std::filesystem::path& path, std::string* bytes) {
  bytes->clear();
  std::error_code unknown;  // the size is only a hint
  if (const auto size = std::filesystem::file_size(path, unknown); !unknown) bytes->reserve(size);
  ReadInPieces(path, [&](std::string_view piece) { bytes->append(piece); });
}

// As many at a time as are hashed together.
void CheckHashes(const SessionReader& session, std::span<const FrameRecord* const> records,
                 std::span<const std::string> bytes) {
  ParallelFor(
      records.size(), Sha256Together(records.size()), [&](std::size_t begin, std::size_t end) {
        std::vector<Sha256Message> messages;
        for (std::size_t n = begin; n < end; ++n) messages.push_back({{}, bytes[n]});
        const auto hashes = Sha256OfEach(messages);
        for (std::size_t n = begin; n < end; ++n)
          if (hashes[n - begin] != records[n]->sha256)
            throw InputError(
                FrameFile(session, *records[n]).string(),
                "differs from the frame that was committed (SHA-256)",
                "restore it from a copy, or run `luxfield verify --salvage` on the session");
      });
}

// A session holds frames of one sensor, whose size session.json states. (Where it states none,
// whoever merges the session refuses it for that.)
void RequireSensorSize(const SessionReader& session, const FrameRecord& record,
                       const RawFrame& frame) {
  const std::string file = (session.folder() / "session.json").string();
  const Json camera = FieldOr<Json>(session.session(), "camera", Json::object(), file);
  const int width = FieldOr(camera, "width", frame.width, file);
  const int height = FieldOr(camera, "height", frame.height, file);
  if (frame.width != width || frame.height != height)
    throw InputError(FrameFile(session, record).string(),
                     fmt::format("has {} x {} pixels, the session's camera has {} x {}",
                                 frame.width, frame.height, width, height),
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
    ParallelFor(records.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) body(n);
    });
  };
  for_each([&](std::size_t n) { ReadInto(FrameFile(session, *records[n]), &bytes[n]); });
  if (check_hashes) CheckHashes(session, records, bytes);
  for_each([&](std::size_t n) {
    DecodeTiff(bytes[n], FrameFile(session, *records[n]).string(), &frames[n]);
    RequireSensorSize(session, *records[n], frames[n]);
  });
}

}  // namespace luxfield::core
