// Who does the shards of a job: this program, GNU parallel or xargs, Slurm. None of them is a
// scheduler of ours; what they are given is written for the user to read.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/shard/job_folder.h"
#include "luxfield/shard/status.h"

namespace luxfield::shard {

struct Submission {
  std::filesystem::path folder;   // of the job
  std::filesystem::path program;  // that does `shard`
  std::vector<int> shards;        // to do
  int jobs = 1;                   // at once, of engines on this machine
  int threads = 0;                // of a shard, 0: the cores over the jobs
};

// What a shard needs, from those that are done.
struct Need {
  double wall_s = 0, peak_mib = 0;  // of the most demanding one; 0: none is done
};
Need NeedOf(const std::vector<ShardStatus>& all);

// Starts a process for each shard, `jobs` at once, and waits for all of them. Numbers of the shards
// that failed; what they had to say is on stderr. Throws Interrupted when all that were begun have
// ended, DeviceError where none can be started.
std::vector<int> RunHere(const Submission& submission);

// A shell script that hands the shards to GNU parallel where there is one, else to xargs, and then
// gathers. Written to FOLDER/submit/.
std::filesystem::path WriteParallelScript(const Submission& submission);

// Two batch scripts for sbatch, an array of shards and what gathers them afterwards; and the shell
// script that submits both.
std::filesystem::path WriteSlurmScripts(const Submission& submission, const Need& need);

// Runs a script with /bin/sh and returns its exit code.
int RunScript(const std::filesystem::path& script);

// Whether $PATH has a program of that name.
bool IsOnPath(const std::string& program);

}  // namespace luxfield::shard
