// Fuzz targets: the journal and the manifest of a session from somewhere else. Anything but an
// InputError is a fault.
#pragma once

#include <cstdlib>
#include <string>
#include <string_view>

#include "core/journal.h"
#include "core/json.h"
#include "core/manifest.h"
#include "core/session_replay.h"

namespace luxfield::fuzz {

// The bytes as a journal; and, since few get past the lines' checksums, lines as records whose
// checksums are right.
inline void SessionJournal(std::string_view input) {
  try {
    const core::JournalContent content = core::ParseJournal(input, "journal.jsonl");
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
    const core::SessionState state = core::ReplayJournal(records, "journal.jsonl");
    for (const core::FrameRecord& record : state.UsableFrames()) {
      if (record.file.empty() || record.file.front() == '/') std::abort();
      if (record.kind == core::FrameKind::kPosition &&
          state.BracketEpoch(record.i, record.j) != record.epoch)
        std::abort();
    }
  } catch (const InputError&) {
  }
}

inline void SessionManifest(std::string_view input) {
  try {
    const core::Manifest manifest = core::ParseManifest(input, "manifest.json");
    if (core::ParseManifest(core::FormatManifest(manifest), "again").files.size() !=
        manifest.files.size())
      std::abort();
  } catch (const InputError&) {
  }
}

}  // namespace luxfield::fuzz
