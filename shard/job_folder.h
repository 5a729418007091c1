// A job on disk: a folder with job.json, which the plan writes, and shards/ with what was done.
//
//   job.json                     verb, words, inputs with their hashes, the whole's figures, shards
//   shards/0007-HASH.exr         what shard 7 wrote; of some verbs a second file
//   shards/0007-HASH.json        its manifest: bytes and SHA-256 of these files, times, memory
//   shards/0007-HASH.failed.json the sentence of its last failure
//   scratch/7.HOST.PID/          what a process is writing now, or was when it was killed
//
// HASH is of the inputs' content, the verb, the words and the rows: a file of that name holds, if it
// is whole, what the shard has to hold, whoever wrote it. Nothing but rename(2) within a folder is
// asked of the file system.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/json.h"
#include "luxfield/shard/task.h"

namespace luxfield::shard {

struct PlannedInput {
  std::filesystem::path file;
  std::uintmax_t bytes = 0;
  std::int64_t modified_ns = 0;
  std::string sha256;
};

struct PlannedShard {
  std::string name;         // NUMBER-HASH
  int first = 0, last = 0;  // the last is none of them
};

struct Job {
  std::string verb;
  std::vector<std::string> words;  // of the verb's command line, paths absolute
  std::string axis;
  int length = 0;
  std::vector<PlannedInput> inputs;
  core::Json whole;
  std::vector<PlannedShard> shards;
};

// A shard's manifest.
struct Manifest {
  struct File {
    std::string name;  // in shards/
    std::uintmax_t bytes = 0;
    std::string sha256;
  };
  std::vector<File> files;
  core::Json figures;
  double wall_s = 0, core_s = 0, peak_mib = 0;
  std::string host;
};

struct Failure {
  std::string sentence, host;
  int exit_code = 0;
};

// Cuts the task: hashes its inputs, finds what shards take from the whole. Of equal parts up to the
// grain; fewer than asked for where the axis has no more grains.
Job MakeJob(const std::string& verb, const std::vector<std::string>& words, const Task& task,
            int shards);

// Writes job.json; nothing where the same job is there. Throws InputError where another one is.
void WriteJob(const std::filesystem::path& folder, const Job& job);
Job ReadJob(const std::filesystem::path& folder);

// Throws InputError where an input is not what it was when the job was planned. Content is compared
// where size or time of the last change differ.
void RequireInputs(const Job& job);

std::filesystem::path ShardsFolder(const std::filesystem::path& folder);
std::filesystem::path ManifestFile(const std::filesystem::path& folder, const PlannedShard& shard);
std::filesystem::path FailureFile(const std::filesystem::path& folder, const PlannedShard& shard);
std::vector<std::filesystem::path> PieceFiles(const std::filesystem::path& folder,
                                              const PlannedShard& shard, const Task& task);

void WriteManifest(const std::filesystem::path& folder, const PlannedShard& shard,
                   const Manifest& manifest);
// None where there is no manifest, or none that can be read.
std::optional<Manifest> FindManifest(const std::filesystem::path& folder,
                                     const PlannedShard& shard);
std::optional<Failure> FindFailure(const std::filesystem::path& folder, const PlannedShard& shard);

enum class Depth { kSizes, kHashes };
// What is wrong with a shard's files by its manifest; empty: they are whole.
std::string WhatIsWrong(const std::filesystem::path& folder, const Manifest& manifest, Depth depth);

// A folder of a process that works, or worked, on a shard.
struct Scratch {
  std::filesystem::path folder;
  int number = 0;
  std::string host;
  long process = 0;
  bool here = false;   // on this host
  bool alive = false;  // only known of this host
};
std::filesystem::path MakeScratch(const std::filesystem::path& folder, int number);
std::vector<Scratch> FindScratch(const std::filesystem::path& folder);

std::string HostName();

}  // namespace luxfield::shard
