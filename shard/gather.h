// All shards of a job to what the verb writes on one machine.
#pragma once

#include <filesystem>

#include "luxfield/shard/job_folder.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

struct Gathered {
  double core_s = 0, longest_s = 0;  // of the shards; core seconds in all, wall time of the slowest
};

// Joins the shards, each of which has to be whole by its manifest's hashes and its files' labels, and
// which together are the whole axis. Throws InputError that names the shards that are missing, and
// files that are damaged or of another shard.
Gathered Gather(const std::filesystem::path& folder, const Job& job, const Task& task);

}  // namespace luxfield::shard
