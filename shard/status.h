// What of a job is done, what is missing, how long shards took, and what failed with which sentence.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/shard/job_folder.h"

namespace luxfield::shard {

enum class State {
  kDone,
  kMissing,  // nobody has begun it, or nobody who left a trace
  kRunning,  // a process of this host does it, or one of another host has begun it
  kKilled,   // a process of this host has begun it and is gone without a word
  kFailed,   // with a sentence
  kDamaged   // its files are not those of its manifest
};
std::string StateName(State state);  // "done", "missing", ...

struct ShardStatus {
  int number = 0;
  PlannedShard shard;
  State state = State::kMissing;
  std::string sentence;                         // of what failed or is damaged, or who has begun it
  double wall_s = 0, core_s = 0, peak_mib = 0;  // of what is done
};

// With a task what is done is read and compared as `run` does (WhatIsWrong), else sizes alone.
std::vector<ShardStatus> StatusOf(const std::filesystem::path& folder, const Job& job,
                                  const Task* task = nullptr);

// The numbers of those that are not done, in their order.
std::vector<int> NotDone(const std::vector<ShardStatus>& all);

}  // namespace luxfield::shard
