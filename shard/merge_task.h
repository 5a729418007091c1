// `merge` of a session, cut along the positions of its plan.
//
// A position is merged from its own frames with what the session has for all of them: dark frames,
// drift references, the exposures' ratios where they are estimated. Every shard reads those.
#pragma once

#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

class MergeTask : public Task {
 public:
  MergeTask(std::filesystem::path session, std::filesystem::path output,
            reconstruct::MergeSessionOptions options);

  std::string Axis() const override { return "positions"; }
  int Length() const override;
  std::vector<std::filesystem::path> Inputs() const override;
  core::Json Whole() const override { return core::Json::object(); }
  std::vector<std::string> Endings(int, int) const override { return {".exr"}; }
  core::Json Run(const core::Json& whole, int first, int last,
                 std::span<const std::filesystem::path> files) const override;
  void Join(const core::Json& whole, std::span<const Piece> pieces) const override;
  std::vector<std::filesystem::path> Outputs() const override { return {output_}; }

 private:
  std::filesystem::path session_, output_;
  reconstruct::MergeSessionOptions options_;
};

}  // namespace luxfield::shard
