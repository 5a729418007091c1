// `reconstruct`, cut into bands of rows of the image plane.
//
// A texel's coefficients are solved from its own measurements. What a solution takes from all texels
// is in Whole(): whether light reaches the outer filters, and the noise of each position where
// moments are kept with measured filters. The sigma of texels of which nothing is known follows from
// C of all others, and is put in when the bands are joined.
#pragma once

#include "luxfield/reconstruct/solve/reconstruct_bands.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

using reconstruct::ReconstructFiles;

class ReconstructTask : public Task {
 public:
  // options.filter is set by the task.
  ReconstructTask(ReconstructFiles files, const reconstruct::ReconstructOptions& options);

  std::string Axis() const override { return "rows"; }
  int Length() const override;
  std::vector<std::filesystem::path> Inputs() const override;
  core::Json Whole() const override;
  std::vector<std::string> Endings(int first, int last) const override;
  core::Json Run(const core::Json& whole, int first, int last,
                 std::span<const std::filesystem::path> files) const override;
  void Join(const core::Json& whole, std::span<const Piece> pieces) const override;
  std::vector<std::filesystem::path> Outputs() const override;

 private:
  ReconstructFiles files_;
  reconstruct::ReconstructOptions options_;
};

}  // namespace luxfield::shard
