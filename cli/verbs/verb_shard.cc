// luxfield shard plan JOB.toml -o DIR; run DIR N; status DIR; gather DIR; submit DIR --engine E
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>

#include "luxfield/cli/program.h"
#include "luxfield/cli/run.h"
#include "luxfield/cli/verbs/sharded_verbs.h"
#include "luxfield/core/error.h"
#include "luxfield/shard/gather.h"
#include "luxfield/shard/job_file.h"
#include "luxfield/shard/job_folder.h"
#include "luxfield/shard/run_shard.h"
#include "luxfield/shard/status.h"
#include "luxfield/shard/submit.h"

namespace luxfield::cli {
namespace {

using shard::Job;
using shard::ShardStatus;
using shard::State;

struct Options {
  std::string job_file, folder, engine;
  int number = 0, jobs = 2;
  bool hashes = false, only_write = false;
};

std::string Span(const Job& job, const shard::PlannedShard& shard) {
  return fmt::format("{} {} to {}", job.axis, shard.first, shard.last - 1);
}

core::Json Plan(const Options& options, int threads) {
  const shard::JobFile file = shard::ReadJobFile(options.job_file);
  const std::vector<std::string> words = WordsOf(file);
  std::unique_ptr<shard::Task> task;
  try {
    task = MakeTask(file.verb, words, threads);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", options.job_file, error.what()));
  }
  const Job job = shard::MakeJob(file.verb, words, *task, file.shards);
  shard::WriteJob(options.folder, job);
  fmt::print("{}: {} of {} {} in {} shards\n", options.folder, job.verb, job.length, job.axis,
             job.shards.size());
  if (static_cast<int>(job.shards.size()) < file.shards)
    fmt::print("  fewer than {}: {} are cut at multiples of {}\n", file.shards, job.axis,
               task->Grain());
  fmt::print("  do them with `luxfield shard submit {} --engine local`, parallel or slurm\n",
             options.folder);
  return {{"job_verb", job.verb},
          {"axis", job.axis},
          {"length", job.length},
          {"shards", job.shards.size()}};
}

core::Json RunOne(const Options& options, int threads) {
  const Job job = shard::ReadJob(options.folder);
  const auto task = MakeTask(job.verb, job.words, threads);
  const auto run = shard::RunShard(options.folder, job, *task, options.number);
  const auto& shard = job.shards[options.number];
  fmt::print("shard {} of {}: {}, {}\n", options.number, job.shards.size(), Span(job, shard),
             run.was_there ? "there already" : fmt::format("{:.2f} s", run.manifest.wall_s));
  return {{"number", options.number},      {"name", shard.name},
          {"was_there", run.was_there},    {"shard_wall_s", run.manifest.wall_s},
          {"core_s", run.manifest.core_s}, {"peak_mib", run.manifest.peak_mib}};
}

core::Json GatherAll(const std::string& folder, int threads) {
  const Job job = shard::ReadJob(folder);
  const auto task = MakeTask(job.verb, job.words, threads);
  const shard::Gathered gathered = shard::Gather(folder, job, *task);
  core::Json outputs = core::Json::array();
  for (const auto& output : task->Outputs()) {
    outputs.push_back(output.string());
    fmt::print("{}: joined from {} shards\n", output.string(), job.shards.size());
  }
  fmt::print("  {:.4g} core-s in all, {:.4g} s the longest shard\n", gathered.core_s,
             gathered.longest_s);
  return {{"outputs", outputs},
          {"shards", job.shards.size()},
          {"core_s", gathered.core_s},
          {"longest_s", gathered.longest_s}};
}

core::Json Describe(const ShardStatus& status) {
  return {{"number", status.number},          {"name", status.shard.name},
          {"first", status.shard.first},      {"last", status.shard.last},
          {"state", StateName(status.state)}, {"sentence", status.sentence},
          {"wall_s", status.wall_s},          {"core_s", status.core_s},
          {"peak_mib", status.peak_mib}};
}

core::Json Status(const Options& options, int threads) {
  const Job job = shard::ReadJob(options.folder);
  const auto task = options.hashes ? MakeTask(job.verb, job.words, threads) : nullptr;
  const auto all = shard::StatusOf(options.folder, job, task.get());
  std::map<std::string, int> counts;
  core::Json shards = core::Json::array();
  double core_s = 0, longest_s = 0;
  for (const ShardStatus& status : all) {
    ++counts[StateName(status.state)];
    shards.push_back(Describe(status));
    if (status.state != State::kDone) continue;
    core_s += status.core_s;
    longest_s = std::max(longest_s, status.wall_s);
  }
  std::vector<std::string> parts;
  for (const auto& [state, count] : counts) parts.push_back(fmt::format("{} {}", count, state));
  fmt::print("{}: {} of {} {}; {} shards: {}\n", options.folder, job.verb, job.length, job.axis,
             all.size(), fmt::join(parts, ", "));
  if (core_s > 0)
    fmt::print("  done in {:.4g} core-s, the longest took {:.4g} s\n", core_s, longest_s);
  for (const ShardStatus& status : all)
    if (status.state != State::kDone)
      fmt::print("  {:>5}  {:<8} {:<24} {}\n", status.number, StateName(status.state),
                 Span(job, status.shard), status.sentence);
  return {{"job_verb", job.verb}, {"axis", job.axis}, {"length", job.length},  {"shards", shards},
          {"counts", counts},     {"core_s", core_s}, {"longest_s", longest_s}};
}

// What the first of them had to say.
[[noreturn]] void FailShards(const std::string& folder, const std::vector<int>& failed) {
  const Job job = shard::ReadJob(folder);
  const auto failure = shard::FindFailure(folder, job.shards[failed.front()]);
  const std::string what = fmt::format(
      "{}: {} of {} shards failed: {}{}; see `luxfield shard status {}`, and submit again what can "
      "be mended",
      folder, failed.size(), job.shards.size(), fmt::join(failed, ", "),
      failure ? fmt::format(" (shard {}: {})", failed.front(), failure->sentence)
              : " (they ended without a word)",
      folder);
  if (failure && failure->exit_code == 2) throw InputError(what);
  throw DeviceError(what);
}

core::Json Submit(const Options& options, const Common& common) {
  const Job job = shard::ReadJob(options.folder);
  const auto task = MakeTask(job.verb, job.words, common.threads);
  const auto all = shard::StatusOf(options.folder, job, task.get());
  shard::Submission submission{.folder = options.folder,
                               .program = std::filesystem::read_symlink("/proc/self/exe"),
                               .shards = shard::NotDone(all),
                               .jobs = options.jobs,
                               .threads = common.threads};
  core::Json json{{"engine", options.engine}, {"submitted", submission.shards}};
  if (options.engine == "local") {
    if (options.only_write)
      throw InputError("--only-write is of the engines parallel and slurm; drop it, or name one");
    if (const auto failed = shard::RunHere(submission); !failed.empty())
      FailShards(options.folder, failed);
    json["gathered"] = GatherAll(options.folder, common.threads);
    return json;
  }
  if (submission.shards.empty()) {
    fmt::print("{}: all shards are done\n", options.folder);
    json["gathered"] = GatherAll(options.folder, common.threads);
    return json;
  }
  const bool slurm = options.engine == "slurm";
  const auto script = slurm ? shard::WriteSlurmScripts(submission, shard::NeedOf(all))
                            : shard::WriteParallelScript(submission);
  json["script"] = script.string();
  fmt::print("{}: written\n", script.string());
  if (options.only_write) return json;
  const std::string needed = slurm ? "sbatch" : shard::IsOnPath("parallel") ? "parallel" : "xargs";
  if (!shard::IsOnPath(needed))
    throw InputError(fmt::format(
        "{} is not on the PATH of this machine; run {} on one that has it, or use --engine local",
        needed, script.string()));
  if (const int code = shard::RunScript(script); code != 0)
    throw DeviceError(fmt::format("{} ended with exit code {}; see `luxfield shard status {}`",
                                  script.string(), code, options.folder));
  return json;
}

void AddFolder(CLI::App& verb, const std::shared_ptr<Options>& options) {
  verb.add_option("DIR", options->folder, "The job's folder, of `shard plan`")->required();
}

}  // namespace

void AddShard(Program& program) {
  CLI::App& group = program.AddGroup(VerbNamed("shard"));
  auto options = std::make_shared<Options>();
  CLI::App& plan = program.AddVerb(
      group, "plan", "Cut a job into shards: merge, reconstruct or render, as job.toml says",
      [options, &program] { return Plan(*options, program.common().threads); });
  plan.add_option("JOB", options->job_file, "The job.toml")->required();
  plan.add_option("-o,--output", options->folder, "The folder to make of it")->required();

  CLI::App& run =
      program.AddVerb(group, "run", "Do one shard, unless it is there and whole",
                      [options, &program] { return RunOne(*options, program.common().threads); });
  AddFolder(run, options);
  run.add_option("N", options->number, "Its number, from 0")->required();

  CLI::App& status = program.AddVerb(
      group, "status", "What is done, missing or failed, with which sentence, and how long it took",
      [options, &program] { return Status(*options, program.common().threads); });
  AddFolder(status, options);
  status.add_flag("--hashes", options->hashes,
                  "Read what is done and compare its SHA-256, and not sizes alone");

  CLI::App& gather = program.AddVerb(
      group, "gather", "Join the shards to what the verb writes on one machine, to the byte",
      [options, &program] { return GatherAll(options->folder, program.common().threads); });
  AddFolder(gather, options);

  CLI::App& submit =
      program.AddVerb(group, "submit", "Have what is not done done, and gather it",
                      [options, &program] { return Submit(*options, program.common()); });
  AddFolder(submit, options);
  submit
      .add_option("--engine", options->engine,
                  "local: processes of this program; parallel: GNU parallel, or xargs where it is "
                  "not there; slurm: sbatch, an array and what gathers it")
      ->required()
      ->check(CLI::IsMember({"local", "parallel", "slurm"}));
  submit.add_option("--jobs", options->jobs, "Shards at once on this machine")
      ->check(CLI::Range(1, 4096));
  submit.add_flag("--only-write", options->only_write,
                  "Write the script of parallel or slurm, and do not run it");
}

}  // namespace luxfield::cli
