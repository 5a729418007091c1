// A capture session on disk: a folder that loses nothing (docs/formats/session.md).
//
//   plan.json       what to measure, expanded; immutable; its SHA-256 is the plan id
//   session.json    devices, firmware, calibration in force
//   journal.jsonl   append-only; each line {"seq", "prev", "type", ..., "crc32c"}:
//                   `prev` is the SHA-256 of the previous line,
//                   `crc32c` comes last: 8 hex digits over the bytes before `,"crc32c"`
//   frames/ darks/ flats/ refs/ targets/   one 16-bit uncompressed TIFF per frame
//   manifest.json   every file with size and SHA-256, written when the session is sealed
//
// A frame exists only if its journal line is valid and its hash matches. Commit: temporary file,
// fsync, rename, fsync of the folder, journal line, fdatasync.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/session/raw_frame.h"

namespace luxfield::session {

enum class FrameKind { kPosition, kDark, kFlat, kReference, kTarget };

// A committed frame, as its journal line has it.
struct FrameRecord {
  FrameKind kind = FrameKind::kPosition;
  int i = -1, j = -1;  // filter position (kPosition), view of the plan in i (kTarget), else -1
  int channel = 0;     // colour filter: 0 for luminance or R, 1 G, 2 B
  int print = 0;       // dual filters: 0 the positive part, 1 the negative; else 0
  int exposure_index = 0, repeat = 0, attempt = 0;
  int epoch = 0;  // grows at every resume; brackets never mix epochs
  double requested_exposure_s = 0, exposure_s = 0;  // exposure_s is read back from the camera
  double attenuation = 1;  // transmittance of the ND filter, a in docs/theory.md 3
  double stage_u_m = 0,
         stage_v_m = 0;  // stage read-back: where the filter's centre was in the luminaire frame
  double t_start_s = 0;  // monotonic clock at the start of the exposure
  double meter = 0;      // monitor reading of the lamp during the exposure, 0 = none
  bool flagged = false;  // kept after the re-shoot bound although a check failed
  std::string file;      // relative to the session folder
  std::string sha256;
};

// A session opened for reading: the journal replayed, only committed frames. Of each filter
// position the frames of the last epoch in which its bracket was finished (journal:
// position_complete) and of each planned frame the last one taken; all darks, flats, references
// and targets.
// Throws InputError naming file and line for damage other than a torn last line; a torn last line
// is damage too once the session is sealed.
class SessionReader {
 public:
  explicit SessionReader(const std::filesystem::path& folder);
  ~SessionReader();
  SessionReader(SessionReader&&) noexcept;

  const std::filesystem::path& folder() const;
  const nlohmann::json& plan() const;     // plan.json
  const nlohmann::json& session() const;  // session.json
  const std::vector<FrameRecord>& frames() const;
  const std::vector<nlohmann::json>& journal() const;  // every valid line, for reports
  bool sealed() const;
  std::string plan_id() const;

  // The pixels; checks size, and the hash when `check_hash`. Throws InputError.
  RawFrame ReadFrame(const FrameRecord& record, bool check_hash = true) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::session
