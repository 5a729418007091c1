// Fuzz targets: the journal and the manifest of a session from somewhere else. Anything but an
// InputError is a fault.
#pragma once

#include <cstdlib>
#include <string>
#include <string_view>

#include "luxfield/core/json.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/manifest.h"
#include "luxfield/session/session_replay.h"

namespace luxfield::fuzz {

// The bytes as a journal; and, since few get past the lines' checksums, lines as records whose
// checksums are right.
inline void SessionJournal(std::string_view input) {
  try {
    const session::JournalContent content = session::ParseJournal(input, "journal.jsonl");
    if (content.valid_bytes > input.size()) std::abort();
  } catch (const InputError&) {
  }
  std::vector<core::Json> records;
  for (std::size_t begin = 0; begin < input.size();) {
    const std::size_t end = std::min(input.find('\n', begin), input.size());
    core::Json record = core::Json::parse(input.substr(begin, end - begin), nullptr, false);
    if (!record.is_discarded()) records.push_back(std::move(record));
    begin = end + 1;
  }
  try {
    const session::SessionState state = session::ReplayJournal(records, "journal.jsonl");
    for (const session::FrameRecord& record : state.UsableFrames()) {
      if (record.file.empty() || record.file.front() == '/') std::abort();
      if (record.kind == session::FrameKind::kPosition &&
          state.BracketEpoch(record.i, record.j) != record.epoch)
        std::abort();
    }
  } catch (const InputError&) {
  }
}

inline void SessionManifest(std::string_view input) {
  try {
    const session::Manifest manifest = session::ParseManifest(input, "manifest.json");
    if (session::ParseManifest(session::FormatManifest(manifest), "again").files.size() !=
        manifest.files.size())
      std::abort();
  } catch (const InputError&) {
  }
}

}  // namespace luxfield::fuzz
