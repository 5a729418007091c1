// The options of `preprocess`, for what else runs it (verb_shard.cc).
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace luxfield::cli {

struct PreprocessOptions {
  std::string light_field, output, scene, max_error = "0.5%", memory;
  int receivers = 1000;
};

void AddPreprocessOptions(CLI::App& verb, const std::shared_ptr<PreprocessOptions>& options);

}  // namespace luxfield::cli
