// A job on disk: a folder with job.json, which the plan writes, and shards/ with what was done.
//
//   job.json                      verb, words, inputs with hashes, figures of the whole, shards
//   shards/0007-HASH.exr          what shard 7 wrote; of some verbs a second file
//   shards/0007-HASH.json         its manifest: bytes and SHA-256 of these, times, memory
//   shards/0007-HASH.failed.json  the sentence of its last failure
//   scratch/                      what processes are writing (scratch.h)
//
// HASH is of the inputs' content, the verb, the words and the rows: a file of that name holds, if it
// is whole, what the shard has to hold, whoever wrote it. It ends with a line that says so
// (piece_label.h), so that one that was moved to another's name is found.
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

// As the files of a job have it, but for its spaces: U+FFFD stands for what is no UTF-8.
std::string TextOf(const core::Json& json);

// NUMBER-HASH: of what decides the content of a shard's files.
std::string NameOf(const Job& job, int number, int first, int last);

// Cuts the task: hashes its inputs, finds what shards take from the whole. Of equal parts up to the
// grain; fewer than asked for where the axis has no more grains. Throws InputError where a word or a
// path is no UTF-8, which job.json has to be.
Job MakeJob(const std::string& verb, const std::vector<std::string>& words, const Task& task,
            int shards);

// Throws InputError where the folder's path has control characters: a line break there would end a
// comment in the scripts of submit.h.
void RequirePlainPath(const std::filesystem::path& folder);

// Writes job.json; nothing where the same job is there. Throws InputError where another one is.
void WriteJob(const std::filesystem::path& folder, const Job& job);
// Throws InputError where a name does not follow from what the file says, and where the shards are
// not the whole axis, each behind the one before it.
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
// None where there is no manifest, or none that can be read or that names files of others.
std::optional<Manifest> FindManifest(const std::filesystem::path& folder,
                                     const PlannedShard& shard);
std::optional<Failure> FindFailure(const std::filesystem::path& folder, const PlannedShard& shard);

// What is wrong with a shard's files by its manifest; empty: nothing. With a task the files are
// those that it makes of the shard, and hashes and labels (piece_label.h) are compared; without one
// sizes alone.
std::string WhatIsWrong(const std::filesystem::path& folder, const Job& job,
                        const PlannedShard& shard, const Manifest& manifest, const Task* task);

}  // namespace luxfield::shard
