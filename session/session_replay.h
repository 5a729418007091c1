// What the records of a session's journal amount to: the one place that knows their fields.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/session/session_store.h"

namespace luxfield::session {

std::string FrameKindName(FrameKind kind);    // "position", "dark", "flat", "reference"
std::string FrameKindFolder(FrameKind kind);  // "frames", "darks", "flats", "refs", "targets"

// The fields of a `frame` line, as in FrameRecord; `where` names file and line in errors
// (InputError).
nlohmann::json FrameToJson(const FrameRecord& record);
FrameRecord FrameFromJson(const nlohmann::json& json, const std::string& where);

struct SessionState {
  std::string plan_sha256, session_sha256;  // of plan.json and session.json, from the first line
  std::vector<std::pair<std::string, std::string>> other_files;  // beside them: name, SHA-256
  std::vector<FrameRecord> committed;                            // every frame line, in order
  // Brackets that were finished: position, epoch and how many frames belong to it (attempts
  // counted).
  struct Bracket {
    int i = 0, j = 0, epoch = 0, frames = 0;
  };
  std::vector<Bracket> brackets;
  // Positions finished since the last reference: what a drift found next makes doubtful.
  std::vector<std::pair<int, int>> since_reference;
  std::map<int, double>
      first_reference_rates;  // per channel: mean_rate of the first reference record
  int last_epoch = -1;
  bool sealed = false;  // the journal says so

  // The last epoch with a whole bracket at (i, j): finished, and all its frames are here; -1 if
  // there is none.
  int BracketEpoch(int i, int j) const;
  // A suspension: brackets of these positions that are finished by now do not count any more.
  void Discard(const std::vector<std::pair<int, int>>& positions);
  // What analysis uses: see SessionReader.
  std::vector<FrameRecord> UsableFrames() const;
};

// One record after the other, `line` from 1. Throws InputError naming `file` and the line for
// records that make no sense.
void ReplayRecord(const nlohmann::json& record, std::size_t line, const std::string& file,
                  SessionState& state);
// For the writer, before it appends a record as that line: throws DeviceError where ReplayRecord
// would refuse it, or where a number in it is not finite, which JSON cannot say.
void RequireReadable(const std::string& type, const nlohmann::json& fields, std::size_t line,
                     const std::string& file);
SessionState ReplayJournal(const std::vector<nlohmann::json>& records, const std::string& file);

}  // namespace luxfield::session
