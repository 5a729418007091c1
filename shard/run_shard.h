// One shard: done, hashed, renamed into its place, its manifest last.
#pragma once

#include <filesystem>

#include "luxfield/shard/job_folder.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

struct ShardRun {
  bool was_there = false;  // whole already: nothing was done
  Manifest manifest;
};

// Does shard `number` of the job in `folder`, unless it is there and whole by its manifest's hashes.
// Several processes may do the same one at once: each writes to a folder of its own (scratch.h) and the
// last rename wins, with equal bytes. A process that is killed leaves that folder, which the next run on
// its host removes. Where the task throws, the sentence is kept for `shard status` and thrown on.
// Throws InputError for a number that the job does not have and for inputs that have changed.
ShardRun RunShard(const std::filesystem::path& folder, const Job& job, const Task& task,
                  int number);

}  // namespace luxfield::shard
