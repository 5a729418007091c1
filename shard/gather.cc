#include "luxfield/shard/gather.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "luxfield/core/error.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/progress.h"

namespace luxfield::shard {
namespace {

constexpr std::size_t kMostNamed = 20;

[[noreturn]] void FailMissing(const std::filesystem::path& folder, std::vector<int> missing,
                              std::size_t shards) {
  const std::size_t count = missing.size();
  missing.resize(std::min(count, kMostNamed));
  throw InputError(
      folder.string(),
      fmt::format("{} of {} shards {} missing: {}{}", count, shards, count == 1 ? "is" : "are",
                  fmt::join(missing, ", "), count > kMostNamed ? ", ..." : ""),
      fmt::format("do them with `luxfield shard run {} {}`, or all with `shard submit`",
                  folder.string(), missing.front()));
}

// job.json does not vouch for its own length.
void RequireWhole(const std::filesystem::path& folder, const Job& job, const Task& task) {
  if (const int length = task.Length(); length != job.length)
    throw InputError(
        (folder / "job.json").string(),
        fmt::format("length = {} where the input has {} {}", job.length, length, task.Axis()),
        "plan the job anew in another folder");
}

}  // namespace

Gathered Gather(const std::filesystem::path& folder, const Job& job, const Task& task) {
  RequireInputs(job);
  RequireWhole(folder, job, task);
  Gathered result;
  std::vector<int> missing;
  std::vector<Piece> pieces;
  std::vector<Manifest> manifests;
  for (std::size_t n = 0; n < job.shards.size(); ++n) {
    const auto manifest = FindManifest(folder, job.shards[n]);
    if (!manifest) {
      missing.push_back(static_cast<int>(n));
      continue;
    }
    manifests.push_back(*manifest);
    pieces.push_back({PieceFiles(folder, job.shards[n], task), manifest->figures});
    result.core_s += manifest->core_s;
    result.longest_s = std::max(result.longest_s, manifest->wall_s);
  }
  if (!missing.empty()) FailMissing(folder, missing, job.shards.size());
  core::Progress progress("check", manifests.size());
  for (std::size_t n = 0; n < manifests.size(); ++n) {
    core::ThrowIfInterrupted();
    if (const std::string wrong = WhatIsWrong(folder, job, job.shards[n], manifests[n], &task);
        !wrong.empty())
      throw InputError(fmt::format("{}; do the shard again with `luxfield shard run {} {}`", wrong,
                                   folder.string(), n));
    progress.Advance();
  }
  core::Outputs outputs;
  task.Join(job.whole, pieces);
  outputs.PutInPlace();
  return result;
}

}  // namespace luxfield::shard
