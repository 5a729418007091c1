// Is a session whole, and what of a damaged one can be kept.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::session {

struct SessionCheck {
  bool sealed = false;
  int lines = 0;      // of the journal
  int frames = 0;     // committed frames whose file matches
  int positions = 0;  // positions with a whole bracket
  // One sentence each, naming the file; empty: the session is whole.
  std::vector<std::string> problems;
  // Lines, frames or the manifest are damaged, so that SalvageSession() helps. Without it what
  // `problems` tells of needs no salvage: a capture that was not finished, a stray file.
  bool damaged = false;
  // Names lead out of the folder, by symbolic links: nothing helps but another copy.
  bool leads_out = false;
};

// Reads everything: the journal's chain, plan.json and session.json, every frame's size and
// SHA-256, the manifest. Damage is listed, not thrown; InputError only if the folder is no session
// at all.
SessionCheck VerifySession(const std::filesystem::path& folder);

struct SalvageResult {
  int lines_kept = 0, lines_lost = 0;
  int frames_kept = 0, frames_lost = 0;
  std::filesystem::path old_journal;  // the damaged journal, set aside; empty: nothing was done
};

// Rewrites the journal from the lines whose CRC is right and the frames whose hash matches; the
// damaged journal stays as journal.damaged-N.jsonl and the manifest is removed, so that the session
// can be resumed: brackets that lost a frame are retaken. Does nothing where VerifySession() finds
// nothing damaged. Throws InputError if the first line, plan.json or session.json is lost, if names
// lead out of the folder, or if another process writes.
SalvageResult SalvageSession(const std::filesystem::path& folder);

}  // namespace luxfield::session
