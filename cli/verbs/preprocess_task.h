// `preprocess`, cut into images of the light field. Where its light leaves I follows from the medians
// of all images, which each piece states, and is put behind them when they are joined.
#pragma once

#include "luxfield/shard/task.h"

namespace luxfield::cli {

class PreprocessTask : public shard::Task {
 public:
  PreprocessTask(std::filesystem::path light_field, std::filesystem::path output)
      : light_field_(std::move(light_field)), output_(std::move(output)) {}

  std::string Axis() const override { return "images"; }
  int Length() const override;
  std::vector<std::filesystem::path> Inputs() const override { return {light_field_}; }
  core::Json Whole() const override { return core::Json::object(); }
  std::vector<std::string> Endings(int, int) const override { return {".exr"}; }
  core::Json Run(const core::Json& whole, int first, int last,
                 std::span<const std::filesystem::path> files) const override;
  void Join(const core::Json& whole, std::span<const shard::Piece> pieces) const override;
  std::vector<std::filesystem::path> Outputs() const override { return {output_}; }

 private:
  std::filesystem::path light_field_, output_;
};

}  // namespace luxfield::cli
