#include "luxfield/shard/run_shard.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/shard/piece_label.h"
#include "luxfield/shard/scratch.h"

namespace luxfield::shard {
namespace {

Manifest Do(const std::filesystem::path& folder, const Job& job, const Task& task, int number) {
  const PlannedShard& shard = job.shards[number];
  const core::Stopwatch stopwatch;
  core::TakePeakMib();
  RequireInputs(job);
  const ScratchFolder scratch(folder, number);
  std::vector<std::filesystem::path> written;
  for (const std::string& ending : task.Endings(shard.first, shard.last))
    written.push_back(scratch.path() / (shard.name + ending));
  Manifest manifest;
  manifest.figures = task.Run(job.whole, shard.first, shard.last, written);
  for (const auto& file : written) {
    const std::string name = file.filename().string();
    AddLabel(file, LabelOf(job, shard, name, manifest.figures));
    manifest.files.push_back({name, std::filesystem::file_size(file), core::Sha256OfFile(file)});
  }
  for (const auto& file : written)
    std::filesystem::rename(file, ShardsFolder(folder) / file.filename());
  core::SyncFolder(ShardsFolder(folder));
  manifest.wall_s = stopwatch.WallSeconds();
  manifest.core_s = stopwatch.CoreSeconds();
  manifest.peak_mib = core::TakePeakMib();
  manifest.host = HostName();
  WriteManifest(folder, shard, manifest);
  core::RemoveFile(FailureFile(folder, shard));
  return manifest;
}

// The sentence of a failure, where the disk still takes it.
void Note(const std::filesystem::path& folder, const PlannedShard& shard, const std::string& what,
          int exit_code) {
  try {
    core::WriteJson(FailureFile(folder, shard),
                    {{"sentence", what}, {"exit_code", exit_code}, {"host", HostName()}});
  } catch (const std::exception&) {
  }
}

}  // namespace

ShardRun RunShard(const std::filesystem::path& folder, const Job& job, const Task& task,
                  int number) {
  if (number < 0 || number >= static_cast<int>(job.shards.size()))
    throw InputError(
        folder.string(),
        fmt::format("has no shard {}: they are numbered 0 to {}", number, job.shards.size() - 1),
        "give one of these numbers");
  const PlannedShard& shard = job.shards[number];
  SweepScratch(folder);  // also what a run left that was killed once its shard was whole
  if (const auto manifest = FindManifest(folder, shard);
      manifest && WhatIsWrong(folder, job, shard, *manifest, &task).empty())
    return {true, *manifest};
  try {
    return {false, Do(folder, job, task, number)};
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    Note(folder, shard, error.what(), error.exit_code());
    throw;
  } catch (const std::exception& error) {
    Note(folder, shard, error.what(), 1);
    throw;
  }
}

}  // namespace luxfield::shard
