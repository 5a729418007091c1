#include "luxfield/session/session_check.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/parallel.h"
#include "luxfield/session/folder_lock.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/manifest.h"
#include "luxfield/session/session_path.h"
#include "luxfield/session/session_replay.h"

namespace luxfield::session {
namespace {

namespace fs = std::filesystem;

// What is wrong with a session's file; empty: nothing.
struct FileProblem {
  std::string what;
  bool leads_out = false;  // of the folder, as links may: salvage does not help
};

// Of the file with this hash. Throws InputError where its name may lead out of the folder.
std::string ContentProblem(const fs::path& folder, const std::string& name,
                           const std::string& sha256) {
  const fs::path path = SessionFile(folder, name, folder.string());
  if (!fs::is_regular_file(path)) return fmt::format("{}: is missing", path.string());
  if (core::Sha256OfFile(path) != sha256)
    return fmt::format("{}: differs from what was committed (SHA-256)", path.string());
  return {};
}

FileProblem ProblemOf(const fs::path& folder, const std::string& name, const std::string& sha256) {
  try {
    return {ContentProblem(folder, name, sha256)};
  } catch (const InputError& error) {
    return {error.what(), true};
  }
}

// A file's name and the SHA-256 that it was committed with.
using CommittedFile = std::pair<std::string, std::string>;

// What the journal's first line vouches for.
std::vector<CommittedFile> DescribingFiles(const SessionState& state) {
  auto files = state.other_files;
  files.emplace_back("plan.json", state.plan_sha256);
  files.emplace_back("session.json", state.session_sha256);
  return files;
}

// Problems of the session's files, each of which is read once.
class FileProblems {
 public:
  explicit FileProblems(const fs::path& folder) : folder_(folder) {}

  // Looks at those that were not looked at yet, on all cores.
  void Find(std::span<const CommittedFile> files) {
    std::vector<decltype(problems_)::iterator> found;
    for (const CommittedFile& file : files)
      if (const auto [place, is_new] = problems_.try_emplace(file); is_new) found.push_back(place);
    core::ParallelFor(found.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        found[n]->second = ProblemOf(folder_, found[n]->first.first, found[n]->first.second);
    });
  }

  // Adds what is wrong with a file to the check. Whether something is.
  bool Add(const CommittedFile& file, SessionCheck& check) const {
    const FileProblem& problem = problems_.at(file);
    if (problem.what.empty()) return false;
    check.problems.push_back(problem.what);
    check.leads_out |= problem.leads_out;
    return true;
  }

 private:
  const fs::path& folder_;
  std::map<CommittedFile, FileProblem> problems_;
};

// `committed`: what the journal vouches for.
void CheckManifest(const fs::path& folder, const JournalContent& journal,
                   const std::vector<CommittedFile>& committed, FileProblems& files,
                   SessionCheck& check) {
  const auto path = folder / "manifest.json";
  const auto damaged = [&](const std::string& file, const std::string& problem) {
    check.damaged = true;
    check.problems.push_back(fmt::format("{}: {}", file, problem));
  };
  try {
    const std::string text = core::ReadFile(path);
    const Manifest manifest = ParseManifest(text, path.string());
    if (text != FormatManifest(manifest)) damaged(path.string(), "is not as the program writes it");
    if (manifest.journal_head != journal.head)
      damaged(path.string(), "journal_head is not the journal's last line");
    std::vector<CommittedFile> listed_files;
    for (const ManifestFile& file : manifest.files)
      listed_files.emplace_back(file.name, file.sha256);
    files.Find(listed_files);
    const std::map<std::string, std::string> vouched(committed.begin(), committed.end());
    std::set<std::string> listed;
    for (const ManifestFile& file : manifest.files) {
      listed.insert(file.name);
      const auto own = vouched.find(file.name);
      if (own != vouched.end() && own->second != file.sha256)
        damaged(path.string(),
                fmt::format("{} is listed with another SHA-256 than the journal's", file.name));
      else if (!files.Add({file.name, file.sha256}, check) &&
               fs::file_size(folder / file.name) != file.bytes)
        damaged(path.string(), fmt::format("{} is listed with {} bytes", file.name, file.bytes));
    }
    for (const CommittedFile& file : committed)
      if (!listed.contains(file.first))
        damaged(path.string(), fmt::format("{} is not listed", file.first));
    for (const CommittedFile& file : committed) listed.insert(file.first);
    std::error_code unreadable;
    fs::path last = folder;
    for (fs::recursive_directory_iterator entry(folder, unreadable), end;
         !unreadable && entry != end; entry.increment(unreadable)) {
      last = entry->path();
      const std::string name = fs::relative(last, folder).string();
      const bool derived = name.starts_with("derived") || name.starts_with("journal.damaged");
      if (entry->is_regular_file() && !derived && name != "LOCK" && name != "manifest.json" &&
          !listed.contains(name))
        check.problems.push_back(
            fmt::format("{}: is not in the manifest; move it out of the session if it is not of it",
                        last.string()));
    }
    if (unreadable)
      check.problems.push_back(fmt::format("{}: cannot be read ({}); let its owner read it",
                                           last.string(), unreadable.message()));
  } catch (const InputError& error) {
    check.damaged = true;
    check.problems.push_back(error.what());
  }
}

}  // namespace

SessionCheck VerifySession(const fs::path& folder) {
  const auto path = folder / "journal.jsonl";
  if (!fs::exists(path))
    throw InputError(folder.string(), "is not a session: it has no journal.jsonl",
                     "name a folder that `luxfield capture` made");
  SessionCheck check;
  for (const char* name : {"journal.jsonl", "manifest.json"}) try {
      SessionFile(folder, name, folder.string());
    } catch (const InputError& error) {
      check.leads_out = true;
      check.problems.push_back(error.what());
    }
  JournalContent journal;
  SessionState state;
  const auto manifest_exists = [&] { return fs::exists(folder / "manifest.json"); };
  bool has_manifest = manifest_exists();
  try {
    journal = ReadJournal(path);
    if (has_manifest != manifest_exists()) {  // sealed just now, its last line before the manifest
      has_manifest = true;
      journal = ReadJournal(path);
    }
    state = ReplayJournal(journal.records, path.string());
  } catch (const InputError& error) {
    check.damaged = true;
    check.problems.push_back(error.what());
    return check;
  }
  const bool being_sealed = state.sealed && !has_manifest && FolderInUse(folder);
  check.sealed = state.sealed && has_manifest;
  check.lines = static_cast<int>(journal.records.size());
  if (journal.records.empty())
    check.problems.push_back(fmt::format("{}: holds no complete line", path.string()));
  else if (journal.torn)
    check.problems.push_back(fmt::format("{}: line {} is unfinished; --resume drops it",
                                         path.string(), journal.records.size() + 1));
  else if (state.sealed != has_manifest && !being_sealed) {
    check.damaged = has_manifest;
    check.problems.push_back(
        fmt::format("{}: {}", folder.string(),
                    has_manifest ? "has a manifest although the journal is not sealed"
                                 : "was sealed but manifest.json is missing; --resume writes it"));
  }
  const auto describing = DescribingFiles(state);
  auto committed = describing;
  for (const FrameRecord& record : state.committed)
    committed.emplace_back(record.file, record.sha256);
  FileProblems files(folder);
  files.Find(committed);
  for (const CommittedFile& file : describing) files.Add(file, check);
  SessionState intact = state;
  intact.committed.clear();
  for (const FrameRecord& record : state.committed) {
    if (files.Add({record.file, record.sha256}, check)) {
      check.damaged = true;
      continue;
    }
    ++check.frames;
    intact.committed.push_back(record);
  }
  std::set<std::pair<int, int>> whole;
  for (const FrameRecord& record : intact.UsableFrames())
    if (record.kind == FrameKind::kPosition) whole.insert({record.i, record.j});
  check.positions = static_cast<int>(whole.size());
  if (has_manifest) CheckManifest(folder, journal, committed, files, check);
  return check;
}

SalvageResult SalvageSession(const fs::path& folder) {
  const auto path = folder / "journal.jsonl";
  if (!fs::exists(path))
    throw InputError(folder.string(), "is not a session: it has no journal.jsonl",
                     "name a folder that `luxfield capture` made");
  const FolderLock lock(folder);  // before the journal is read: no other process adds to it now
  SalvageResult result;
  if (const SessionCheck check = VerifySession(folder); !check.damaged) {
    result.lines_kept = check.lines;
    result.frames_kept = check.frames;
    return result;
  }
  const std::string bytes = core::ReadFile(path);
  const fs::path manifest = SessionFile(folder, "manifest.json", folder.string());
  std::vector<core::Json> kept;
  SessionState read;  // what the lines say that can be read
  std::set<std::uint64_t> seen;
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    core::Json record;
    const bool valid =
        ParseJournalLine(std::string_view(bytes).substr(begin, end - begin), record) &&
        seen.insert(record["seq"].get<std::uint64_t>()).second;
    begin = end + 1;
    if (!valid) {
      ++result.lines_lost;
      continue;
    }
    const auto type = record["type"].get<std::string>();
    if (kept.empty() && type != "session_open") break;
    if (type == "sealed") continue;
    try {
      ReplayRecord(record, kept.size() + 1, path.string(), read);
    } catch (const InputError&) {  // whole, but it makes no sense
      ++result.lines_lost;
      continue;
    }
    if (type == "frame") {
      const FrameRecord& frame = read.committed.back();
      if (!ContentProblem(folder, frame.file, frame.sha256).empty()) {
        ++result.frames_lost;
        continue;
      }
      ++result.frames_kept;
    }
    kept.push_back(std::move(record));
  }
  if (kept.empty())
    throw InputError(path.string(),
                     "line 1 (session_open) is lost; no frame can be trusted without it",
                     "capture the session anew");
  const SessionState state = ReplayJournal(kept, path.string());
  for (const auto& [name, sha256] : DescribingFiles(state))
    if (const auto problem = ContentProblem(folder, name, sha256); !problem.empty())
      throw InputError(problem + "; restore it from a copy, nothing can be salvaged without it");

  std::string journal, prev(64, '0');
  for (std::size_t seq = 0; seq < kept.size(); ++seq) {
    core::Json fields = kept[seq];
    const auto type = fields["type"].get<std::string>();
    for (const char* key : {"seq", "prev", "type", "crc32c"}) fields.erase(key);
    const std::string line = FormatJournalLine(seq, prev, type, fields);
    prev = core::Sha256(line);
    journal += line + '\n';
  }
  result.lines_kept = static_cast<int>(kept.size());
  for (int n = 1; result.old_journal.empty() || fs::exists(result.old_journal); ++n)
    result.old_journal = folder / fmt::format("journal.damaged-{}.jsonl", n);
  core::WriteFileAtomically(result.old_journal, bytes, core::Access::kPrivate);
  core::RemoveFile(manifest);
  core::WriteFileAtomically(path, journal, core::Access::kPrivate);
  return result;
}

}  // namespace luxfield::session
