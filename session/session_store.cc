#include "luxfield/session/session_store.h"

#include <fmt/format.h>

#include <mutex>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/session/frame_file.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/session_replay.h"

namespace luxfield::session {

struct SessionReader::Impl {
  std::filesystem::path folder;
  core::Json plan, session;
  SessionState state;
  std::vector<FrameRecord> frames;
  bool has_manifest = false;
  // Only few ask for it, and of a long session it is large.
  std::size_t journal_lines = 0;
  std::once_flag journal_read;
  std::vector<core::Json> journal;
};

SessionReader::SessionReader(const std::filesystem::path& folder)
    : impl_(std::make_unique<Impl>()) {
  impl_->folder = folder;
  const auto journal = folder / "journal.jsonl";
  if (!std::filesystem::exists(journal))
    throw InputError(folder.string(), "is not a session: it has no journal.jsonl",
                     "name a folder that `luxfield capture` made");
  const JournalEnd end = VisitJournal(journal, [&](core::Json&& record, std::size_t line) {
    ReplayRecord(record, line, journal.string(), impl_->state);
  });
  impl_->journal_lines = end.lines;
  impl_->has_manifest = std::filesystem::exists(folder / "manifest.json");
  if (end.torn && impl_->has_manifest)
    throw InputError(
        journal.string(),
        fmt::format("line {} is damaged although the session was sealed", end.lines + 1),
        "run `luxfield verify --salvage` on the session to keep what is intact");
  if (end.lines == 0)
    throw InputError(journal.string(), "holds no complete line", "capture the session anew");
  const auto read_checked = [&](const char* name, const std::string& sha256) {
    const auto path = folder / name;
    const std::string bytes = core::ReadFile(path);
    if (core::Sha256(bytes) != sha256)
      throw InputError(path.string(), "differs from the one the session was captured with",
                       "restore it from a copy");
    return core::ParseJson(bytes, path.string());
  };
  impl_->plan = read_checked("plan.json", impl_->state.plan_sha256);
  impl_->session = read_checked("session.json", impl_->state.session_sha256);
  impl_->frames = impl_->state.UsableFrames();
}

SessionReader::~SessionReader() = default;
SessionReader::SessionReader(SessionReader&&) noexcept = default;

const std::filesystem::path& SessionReader::folder() const { return impl_->folder; }
const core::Json& SessionReader::plan() const { return impl_->plan; }
const core::Json& SessionReader::session() const { return impl_->session; }
const std::vector<FrameRecord>& SessionReader::frames() const { return impl_->frames; }
const std::vector<core::Json>& SessionReader::journal() const {
  std::call_once(impl_->journal_read, [this] {
    impl_->journal = ReadJournal(impl_->folder / "journal.jsonl").records;
    if (impl_->journal.size() > impl_->journal_lines)  // a capture goes on meanwhile
      impl_->journal.resize(impl_->journal_lines);
  });
  return impl_->journal;
}
bool SessionReader::sealed() const { return impl_->state.sealed && impl_->has_manifest; }
std::string SessionReader::plan_id() const { return impl_->state.plan_sha256; }

RawFrame SessionReader::ReadFrame(const FrameRecord& record, bool check_hash) const {
  std::string bytes;
  RawFrame frame;
  session::ReadFrame(*this, record, check_hash, &bytes, &frame);
  return frame;
}

}  // namespace luxfield::session
