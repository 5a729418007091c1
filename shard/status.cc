#include "luxfield/shard/status.h"

#include <fmt/format.h>

#include "luxfield/shard/scratch.h"

namespace luxfield::shard {
namespace {

// Who has begun a shard that has no manifest.
void SayWhoBegan(const std::vector<Scratch>& scratch, ShardStatus& status) {
  for (const Scratch& begun : scratch) {
    if (begun.number != status.number) continue;
    const std::string who = fmt::format("process {} on {}", begun.process, begun.host);
    if (begun.alive || !begun.here) {
      status.state = State::kRunning;
      status.sentence =
          begun.here ? fmt::format("{} does it", who)
                     : fmt::format("{} has begun it, and may have ended without a word", who);
      return;
    }
    if (status.state == State::kFailed) continue;
    status.state = State::kKilled;
    status.sentence = fmt::format("{} had begun it and ended without a word", who);
  }
}

}  // namespace

std::string StateName(State state) {
  switch (state) {
    case State::kDone:
      return "done";
    case State::kMissing:
      return "missing";
    case State::kRunning:
      return "running";
    case State::kKilled:
      return "killed";
    case State::kFailed:
      return "failed";
    case State::kDamaged:
      return "damaged";
  }
  return "";
}

std::vector<ShardStatus> StatusOf(const std::filesystem::path& folder, const Job& job,
                                  const Task* task) {
  const std::vector<Scratch> scratch = FindScratch(folder);
  std::vector<ShardStatus> all;
  for (std::size_t n = 0; n < job.shards.size(); ++n) {
    ShardStatus status;
    status.number = static_cast<int>(n);
    status.shard = job.shards[n];
    if (const auto manifest = FindManifest(folder, status.shard)) {
      status.sentence = WhatIsWrong(folder, job, status.shard, *manifest, task);
      status.state = status.sentence.empty() ? State::kDone : State::kDamaged;
      status.wall_s = manifest->wall_s;
      status.core_s = manifest->core_s;
      status.peak_mib = manifest->peak_mib;
    } else if (const auto failure = FindFailure(folder, status.shard)) {
      status.state = State::kFailed;
      status.sentence = failure->sentence;
    }
    if (status.state != State::kDone) SayWhoBegan(scratch, status);
    all.push_back(std::move(status));
  }
  return all;
}

std::vector<int> NotDone(const std::vector<ShardStatus>& all) {
  std::vector<int> numbers;
  for (const ShardStatus& status : all)
    if (status.state != State::kDone) numbers.push_back(status.number);
  return numbers;
}

}  // namespace luxfield::shard
