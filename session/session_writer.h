// Writing a session (session/session_store.h): the commit protocol and the journal's chain.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/session/session_store.h"

namespace luxfield::session {

// One writer at a time: the session's LOCK file is held (flock) until destruction. Every method
// that returns has made its effect durable, CommitFrameBehind excepted. After a DeviceError nothing
// half-written counts: open the session again with Resume.
class SessionWriter {
 public:
  // Whether there is something to resume: a journal with at least one complete line.
  static bool HasSession(const std::filesystem::path& folder);
  // A new session in a folder that does not exist, is empty, or holds only what a Create that was
  // killed left. Extra files (name, bytes), such as a vignetting image, are written beside
  // session.json. Throws InputError for a folder with anything else in it or in use by another
  // process, DeviceError for the disk.
  static SessionWriter Create(const std::filesystem::path& folder, const nlohmann::json& plan,
                              const nlohmann::json& session,
                              const std::vector<std::pair<std::string, std::string>>& extra,
                              core::Clock& clock);
  // Opens an unsealed session for more: drops a torn last line, removes temporary files and frames
  // without a journal line, and leaves the rest alone. The plan must be the one the session has
  // (InputError). Starting a new epoch is the caller's.
  static SessionWriter Resume(const std::filesystem::path& folder, const nlohmann::json& plan,
                              core::Clock& clock);

  ~SessionWriter();
  SessionWriter(SessionWriter&&) noexcept;

  const std::filesystem::path& folder() const;
  int epoch() const;  // of the last StartEpoch; -1 before the first
  bool journal_says_sealed()
      const;  // killed between the sealed line and the manifest: Seal() again
  const std::vector<FrameRecord>& committed_frames() const;
  // Mean rate of the session's first reference per channel (journal: reference), to compare later
  // ones with.
  const std::map<int, double>& first_reference_rates() const;
  // Whether (i, j) has a whole bracket in some epoch.
  bool PositionComplete(int i, int j) const;

  // Begins the next epoch; `devices` describes what was found connected.
  void StartEpoch(const nlohmann::json& devices);
  // Commits one frame: TIFF, then its journal line with the record's fields and `checks`. Sets
  // epoch, file and sha256 (and raises attempt past what this epoch already has) and returns the
  // record as written.
  FrameRecord CommitFrame(FrameRecord record, const RawFrame& frame, const nlohmann::json& checks);
  // The same on threads of its own, while the caller takes more frames: it returns at once unless
  // sixteen frames wait already, and every other method first waits for the commits and throws what
  // went wrong with them.
  void CommitFrameBehind(FrameRecord record, std::shared_ptr<const RawFrame> frame,
                         nlohmann::json checks);
  void CompletePosition(int i, int j);
  // The journal's `reference`: what was finished before it is good.
  void AcceptReference(nlohmann::json fields);
  // The journal's `suspended`: positions finished since the last AcceptReference, of earlier runs
  // too, are incomplete again and returned. They are to be taken in another epoch.
  std::vector<std::pair<int, int>> Suspend(nlohmann::json fields);
  // Any other event: adds t_s (monotonic) and utc.
  void Append(const std::string& type, nlohmann::json fields);
  // Writes the sealed line and manifest.json. Nothing can be added afterwards.
  void Seal(const std::string& status);

 private:
  struct Impl;
  explicit SessionWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::session
