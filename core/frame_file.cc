#include "core/frame_file.h"

#include "core/error.h"
#include "core/file.h"
#include "core/session_path.h"

namespace luxfield::core {

void ReadFrame(const SessionReader& session, const FrameRecord& record, bool check_hash,
               std::string* bytes, RawFrame* frame) {
  const auto path = SessionFile(session.folder(), record.file, session.folder().string());
  bytes->clear();
  std::error_code unknown;  // the size is only a hint
  if (const auto size = std::filesystem::file_size(path, unknown); !unknown) bytes->reserve(size);
  ReadInPieces(path, [&](std::string_view piece) { bytes->append(piece); });
  if (check_hash && Sha256(*bytes) != record.sha256)
    throw InputError(path.string(), "differs from the frame that was committed (SHA-256)",
                     "restore it from a copy, or run `luxfield verify --salvage` on the session");
  DecodeTiff(*bytes, path.string(), frame);
}

}  // namespace luxfield::core
