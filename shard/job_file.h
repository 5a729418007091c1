// job.toml: a verb, its input, its output, its options and into how many shards it is cut
// (docs/formats/job.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/config.h"

namespace luxfield::shard {

constexpr int kMostShards = 100000;

struct JobFile {
  core::Config file;  // whose Finish() the reader of `options` calls
  std::string verb;
  std::vector<std::filesystem::path> inputs;  // absolute
  std::filesystem::path output;               // absolute
  int shards = 1;
  std::optional<core::Config> options;  // [options], if there is one
};

// Throws InputError naming file and field. Which verbs can be cut, and which options they have, is
// not judged here.
JobFile ReadJobFile(const std::filesystem::path& path);

// A path of the job as it is meant: relative to job.toml.
std::filesystem::path FromJobFile(const std::filesystem::path& job_file, const std::string& path);

}  // namespace luxfield::shard
