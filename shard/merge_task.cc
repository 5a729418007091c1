#include "luxfield/shard/merge_task.h"

#include "luxfield/reconstruct/merge/merge_session_json.h"
#include "luxfield/shard/join_exr.h"

namespace luxfield::shard {

MergeTask::MergeTask(std::filesystem::path session, std::filesystem::path output,
                     reconstruct::MergeSessionOptions options)
    : session_(std::move(session)), output_(std::move(output)), options_(std::move(options)) {}

int MergeTask::Length() const {
  const session::SessionReader session(session_);
  return reconstruct::CalibratedPlan(session, options_).geometry.grid.count();
}

std::vector<std::filesystem::path> MergeTask::Inputs() const {
  // The journal holds the hashes of the frames, which the merge compares.
  std::vector<std::filesystem::path> files{session_ / "plan.json", session_ / "session.json",
                                           session_ / "journal.jsonl"};
  files.insert(files.end(), options_.calibrations.begin(), options_.calibrations.end());
  if (!options_.flat_field.empty()) files.push_back(options_.flat_field);
  return files;
}

core::Json MergeTask::Run(const core::Json&, int first, int last,
                          std::span<const std::filesystem::path> files) const {
  const session::SessionReader session(session_);
  reconstruct::MergeSessionSummary summary;
  reconstruct::MergePositionsToFile(session, files[0], first, last, options_, &summary);
  return reconstruct::ToJson(summary);
}

void MergeTask::Join(const core::Json&, std::span<const Piece> pieces) const {
  std::vector<std::filesystem::path> files;
  for (const Piece& piece : pieces) files.push_back(piece.files[0]);
  JoinExrParts(files, output_, core::ExrCompression::kNone);
}

}  // namespace luxfield::shard
