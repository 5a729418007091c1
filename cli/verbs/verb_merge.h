// The options of `merge`, for what else runs it (verb_shard.cc).
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::cli {

struct MergeOptions {
  std::vector<std::filesystem::path> inputs;
  std::string output, estimator = "inverse-variance", lamp_level = "first-reference", flat_field,
                      memory;
  std::vector<std::filesystem::path> calibrations;
  std::vector<double> exposures_s;
  bool skip_hashes = false, estimate_exposures = false;
};

void AddMergeOptions(CLI::App& verb, const std::shared_ptr<MergeOptions>& options);

// Of a session.
reconstruct::MergeSessionOptions HowToMerge(const MergeOptions& options);

}  // namespace luxfield::cli
