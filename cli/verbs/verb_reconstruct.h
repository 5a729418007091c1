// The options of `reconstruct`, for what else runs it (verb_shard.cc).
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/reconstruct/solve/reconstruct_bands.h"

namespace luxfield::cli {

struct ReconstructVerbOptions {
  std::vector<std::string> measurements;
  std::string output, sigma, filter, regularise, keep = "moments", metric = "coefficients", memory;
  bool double_precision = false, non_negative = false;
};

void AddReconstructOptions(CLI::App& verb, const std::shared_ptr<ReconstructVerbOptions>& options);

// All but the filter, which its file holds.
reconstruct::ReconstructOptions HowToReconstruct(const ReconstructVerbOptions& options);

reconstruct::ReconstructFiles FilesOf(const ReconstructVerbOptions& options);

}  // namespace luxfield::cli
