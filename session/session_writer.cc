#include "luxfield/session/session_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/sha256.h"
#include "luxfield/core/staged_file.h"
#include "luxfield/session/background_queue.h"
#include "luxfield/session/folder_lock.h"
#include "luxfield/session/hash_queue.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/manifest.h"
#include "luxfield/session/session_path.h"
#include "luxfield/session/session_replay.h"

namespace luxfield::session {
namespace {

namespace fs = std::filesystem;

// A disk may take many exposures for one; as many frames may be hashed together, and as many wait.
constexpr std::size_t kWaitingFrames = 2 * core::kSha256Lanes;
constexpr std::array kFrameFolders = {"frames", "darks", "flats", "refs", "targets"};

bool IsTemporary(const fs::path& path) { return core::IsTemporaryName(path.filename().string()); }

void WritePrivate(const fs::path& path, std::string_view bytes) {
  core::WriteFileAtomically(path, bytes, core::Access::kPrivate);
}

// What is written to has to be inside the session.
void RefuseLinks(const fs::path& folder) {
  for (const char* name : {"plan.json", "session.json", "journal.jsonl", "manifest.json", "LOCK",
                           "frames", "darks", "flats", "refs", "targets"})
    SessionFile(folder, name, folder.string());
}

void MakeFrameFolders(const fs::path& folder) {
  for (const char* name : kFrameFolders) core::MakeFolder(folder / name, core::Access::kPrivate);
}

// Leftovers of a killed Create are overwritten; anything else belongs to somebody.
void RefuseForeignFiles(const fs::path& folder,
                        const std::vector<std::pair<std::string, std::string>>& extra) {
  std::set<std::string> ours = {"plan.json", "session.json", "journal.jsonl", "LOCK",   "frames",
                                "darks",     "flats",        "refs",          "targets"};
  for (const auto& [name, bytes] : extra) ours.insert(name);
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool full_folder = entry.is_directory() && !fs::is_empty(entry.path());
    if (!IsTemporary(entry.path()) && (!ours.contains(name) || full_folder))
      throw InputError(folder.string(),
                       fmt::format("holds '{}', which is not part of a new session", name),
                       "choose an empty folder");
  }
}

// Files that no journal line names: what a crash between rename and journal line leaves.
void RemoveOrphans(const fs::path& folder, const SessionState& state) {
  std::set<std::string> known;
  for (const FrameRecord& record : state.committed) known.insert(record.file);
  std::vector<fs::path> orphans;
  for (const char* name : kFrameFolders)
    if (fs::is_directory(folder / name))
      for (const auto& entry : fs::directory_iterator(folder / name))
        if (!entry.is_directory() && !known.contains(fs::path(name) / entry.path().filename()))
          orphans.push_back(entry.path());
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && IsTemporary(entry.path())) orphans.push_back(entry.path());
  for (const auto& path : orphans) core::RemoveFile(path);
}

std::string FrameFileName(const FrameRecord& r) {
  const std::string place =
      r.kind == FrameKind::kPosition ? fmt::format("i{:03}_j{:03}_", r.i, r.j) : std::string();
  return fmt::format("{}/{}print{}_channel{}_exposure{:02}_repeat{}_epoch{}_attempt{}.tif",
                     FrameKindFolder(r.kind), place, r.print, r.channel, r.exposure_index, r.repeat,
                     r.epoch, r.attempt);
}

}  // namespace

struct SessionWriter::Impl {
  Impl(const fs::path& folder_, core::Clock& clock_)
      : folder(folder_), clock(clock_), lock(folder_) {}

  fs::path folder;
  core::Clock& clock;
  FolderLock lock;
  std::unique_ptr<JournalWriter> journal;
  SessionState state;
  std::set<std::string> files;  // frames, those that wait included

  // A frame whose file is not in place yet, nor in the journal.
  struct Staged {
    FrameRecord record;
    core::StagedFile file;
    core::Json line;
  };
  std::optional<Staged> last;  // of the frames behind the caller

  // What a frame's file is to hold.
  struct FrameBytes {
    std::string head;
    std::shared_ptr<const RawFrame> frame;

    core::Sha256Message message() const { return {head, PixelBytes(*frame)}; }
  };
  HashQueue hashes{kWaitingFrames};  // which may take longer than the disk
  // Of frames to be stored; last, so that it is done before the rest goes. Whatever else reads or
  // changes the journal or the state settles first.
  BackgroundQueue behind{kWaitingFrames};

  FrameRecord Named(FrameRecord record) {
    record.epoch = state.last_epoch;
    while (!files.insert(record.file = FrameFileName(record)).second) ++record.attempt;
    return record;
  }

  core::Json Stamped(core::Json fields) {
    fields["t_s"] = clock.MonotonicSeconds();
    fields["utc"] = clock.UtcIso8601();
    return fields;
  }

  void Append(const std::string& type, const core::Json& fields) {
    if (state.sealed)
      throw DeviceError(
          fmt::format("{}: the session is sealed; nothing can be added", folder.string()));
    RequireReadable(type, fields, journal->next_seq() + 1, JournalName());
    journal->Append(type, fields);
  }
  std::string JournalName() const { return (folder / "journal.jsonl").string(); }

  // `stamped` has the time at which the frame came.
  Staged Stage(FrameRecord record, const core::Sha256Message& bytes, std::string sha256,
               const core::Json& checks, core::Json stamped) const {
    record.sha256 = std::move(sha256);
    core::StagedFile file(folder / record.file, std::array{bytes.head, bytes.body},
                          core::Access::kPrivate);
    stamped.update(FrameToJson(record));
    stamped["bytes"] = bytes.head.size() + bytes.body.size();
    stamped["checks"] = checks;
    return {std::move(record), std::move(file), std::move(stamped)};
  }

  FrameRecord Finish(Staged frame) {
    frame.file.PutInPlace();
    Append("frame", frame.line);
    state.committed.push_back(frame.record);
    return std::move(frame.record);
  }
  void FinishLast() {
    if (last) Finish(*std::exchange(last, std::nullopt));
  }

  // Behind the caller: while frames wait, the disk takes a frame's bytes as the next one's are
  // handed to it, and is waited for after that.
  void StoreBehind(FrameRecord record, const core::Sha256Message& bytes,
                   const std::shared_future<std::string>& sha256, const core::Json& checks,
                   core::Json stamped) {
    std::optional<Staged> next;
    try {
      next.emplace(Stage(std::move(record), bytes, sha256.get(), checks, std::move(stamped)));
    } catch (...) {
      FinishLast();
      throw;
    }
    FinishLast();
    last.emplace(*std::move(next));
    if (!behind.Waiting()) FinishLast();
  }
};

SessionWriter::SessionWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SessionWriter::~SessionWriter() = default;
SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;

bool SessionWriter::HasSession(const fs::path& folder) {
  const auto path = folder / "journal.jsonl";
  return fs::exists(path) && !ReadJournal(path).records.empty();
}

SessionWriter SessionWriter::Create(const fs::path& folder, const core::Json& plan,
                                    const core::Json& session,
                                    const std::vector<std::pair<std::string, std::string>>& extra,
                                    core::Clock& clock) {
  if (fs::exists(folder) && !fs::is_directory(folder))
    throw InputError(folder.string(), "is a file, not a folder",
                     "choose another name for the session");
  core::MakeFolder(folder, core::Access::kPrivate);
  RefuseLinks(folder);
  const auto refuse_taken = [&] {
    if (HasSession(folder))
      throw InputError(folder.string(), "already holds a session",
                       "continue it with --resume or choose another folder");
    RefuseForeignFiles(folder, extra);
  };
  refuse_taken();  // so that no lock is left in somebody's folder
  core::StorageStep("looked");
  auto impl = std::make_unique<Impl>(folder, clock);
  refuse_taken();  // another process may have captured, sealed and gone since
  MakeFrameFolders(folder);
  RemoveOrphans(folder, {});
  for (const auto& [name, bytes] : extra) WritePrivate(folder / name, bytes);
  const std::string plan_bytes = plan.dump(2) + "\n", session_bytes = session.dump(2) + "\n";
  WritePrivate(folder / "plan.json", plan_bytes);
  WritePrivate(folder / "session.json", session_bytes);
  impl->state.plan_sha256 = core::Sha256(plan_bytes);
  impl->state.session_sha256 = core::Sha256(session_bytes);
  core::RemoveFile(folder / "journal.jsonl");  // of a Create killed before its first line was whole
  impl->journal = std::make_unique<JournalWriter>(folder / "journal.jsonl");
  SessionWriter writer(std::move(impl));
  core::Json hashes = core::Json::object();
  for (const auto& [name, bytes] : extra) hashes[name] = core::Sha256(bytes);
  writer.Append("session_open", {{"plan_sha256", writer.impl_->state.plan_sha256},
                                 {"session_sha256", writer.impl_->state.session_sha256},
                                 {"files", hashes},
                                 {"format", 1}});
  return writer;
}

SessionWriter SessionWriter::Resume(const fs::path& folder, const core::Json& plan,
                                    core::Clock& clock) {
  const auto path = folder / "journal.jsonl";
  if (!fs::exists(path))
    throw InputError(folder.string(), "is not a session: it has no journal.jsonl",
                     "capture it without --resume");
  RefuseLinks(folder);
  auto impl = std::make_unique<Impl>(folder, clock);
  if (fs::exists(folder / "manifest.json"))
    throw InputError(folder.string(), "is sealed: nothing is left to capture",
                     "choose another folder");
  const JournalContent content = ReadJournal(path);
  if (content.records
          .empty()) {  // killed while the first line was written: nothing was captured yet
    impl.reset();
    core::RemoveFile(path);
    throw InputError(folder.string(), "holds no frame yet", "capture it without --resume");
  }
  impl->state = ReplayJournal(content.records, path.string());
  for (const auto& [name, sha256] : {std::pair{"plan.json", impl->state.plan_sha256},
                                     std::pair{"session.json", impl->state.session_sha256}})
    if (core::Sha256OfFile(folder / name) != sha256)
      throw InputError((folder / name).string(),
                       "differs from the one the session was started with",
                       "restore it from a copy");
  if (core::Sha256(plan.dump(2) + "\n") != impl->state.plan_sha256)
    throw InputError((folder / "plan.json").string(), "is another plan than the one given",
                     "resume with the plan the session was started with");
  MakeFrameFolders(folder);
  RemoveOrphans(folder, impl->state);
  for (const FrameRecord& record : impl->state.committed) impl->files.insert(record.file);
  impl->journal = std::make_unique<JournalWriter>(path, content);
  return SessionWriter(std::move(impl));
}

const fs::path& SessionWriter::folder() const { return impl_->folder; }
int SessionWriter::epoch() const { return impl_->state.last_epoch; }
bool SessionWriter::journal_says_sealed() const { return impl_->state.sealed; }
const std::vector<FrameRecord>& SessionWriter::committed_frames() const {
  impl_->behind.Settle();
  return impl_->state.committed;
}
const std::map<int, double>& SessionWriter::first_reference_rates() const {
  return impl_->state.first_reference_rates;
}
bool SessionWriter::PositionComplete(int i, int j) const {
  impl_->behind.Settle();
  return impl_->state.BracketEpoch(i, j) >= 0;
}

void SessionWriter::StartEpoch(const core::Json& devices) {
  Append("epoch_start", {{"epoch", impl_->state.last_epoch + 1}, {"devices", devices}});
  ++impl_->state.last_epoch;
}

FrameRecord SessionWriter::CommitFrame(FrameRecord record, const RawFrame& frame,
                                       const core::Json& checks) {
  impl_->behind.Settle();
  const std::string head = TiffHead(frame);
  const core::Sha256Message bytes{head, PixelBytes(frame)};
  return impl_->Finish(impl_->Stage(impl_->Named(std::move(record)), bytes,
                                    core::Sha256OfEach({&bytes, 1}).front(), checks,
                                    impl_->Stamped(core::Json::object())));
}

void SessionWriter::CommitFrameBehind(FrameRecord record, std::shared_ptr<const RawFrame> frame,
                                      core::Json checks) {
  const auto bytes = std::make_shared<const Impl::FrameBytes>(TiffHead(*frame), std::move(frame));
  // The clock stays with this thread: a simulated one is no other's.
  impl_->behind.Push([impl = impl_.get(), record = impl_->Named(std::move(record)), bytes,
                      sha256 = impl_->hashes.Push(bytes->message(), bytes),
                      checks = std::move(checks), stamped = impl_->Stamped(core::Json::object())] {
    impl->StoreBehind(record, bytes->message(), sha256, checks, stamped);
  });
}

void SessionWriter::CompletePosition(int i, int j) {
  impl_->behind.Settle();
  const int epoch = impl_->state.last_epoch;
  const auto& committed = impl_->state.committed;
  const auto frames = std::count_if(committed.begin(), committed.end(), [&](const FrameRecord& r) {
    return r.kind == FrameKind::kPosition && r.i == i && r.j == j && r.epoch == epoch;
  });
  Append("position_complete", {{"i", i}, {"j", j}, {"epoch", epoch}, {"frames", frames}});
  impl_->state.brackets.push_back({i, j, epoch, static_cast<int>(frames)});
  impl_->state.since_reference.emplace_back(i, j);
}

void SessionWriter::AcceptReference(core::Json fields) {
  Append("reference", std::move(fields));
  impl_->state.since_reference.clear();
}

std::vector<std::pair<int, int>> SessionWriter::Suspend(core::Json fields) {
  std::vector<std::pair<int, int>> retake = impl_->state.since_reference;
  fields["retake"] = retake;
  Append("suspended", std::move(fields));
  impl_->state.Discard(retake);
  return retake;
}

void SessionWriter::Append(const std::string& type, core::Json fields) {
  impl_->behind.Settle();
  impl_->Append(type, impl_->Stamped(std::move(fields)));
}

void SessionWriter::Seal(const std::string& status) {
  impl_->behind.Settle();
  if (!impl_->state.sealed) {
    Append("sealed", {{"status", status}, {"frames", impl_->files.size()}});
    impl_->state.sealed = true;
  }
  std::map<std::string, std::string> hashes;
  for (const auto& entry : fs::directory_iterator(impl_->folder))
    if (const std::string name = entry.path().filename().string();
        entry.is_regular_file() && name != "LOCK")
      hashes[name] = core::Sha256OfFile(entry.path());
  for (const FrameRecord& frame : impl_->state.committed) hashes[frame.file] = frame.sha256;
  Manifest manifest{impl_->journal->head(), {}};
  for (const auto& [name, sha256] : hashes)
    manifest.files.push_back({name, fs::file_size(impl_->folder / name), sha256});
  WritePrivate(impl_->folder / "manifest.json", FormatManifest(manifest));
}

}  // namespace luxfield::session
