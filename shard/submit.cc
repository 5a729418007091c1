#include "luxfield/shard/submit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <thread>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"

extern char** environ;

namespace luxfield::shard {
namespace {

// A word for a shell, in single quotes.
std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

int ThreadsOf(const Submission& submission) {
  if (submission.threads > 0) return submission.threads;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return std::max(1, cores / std::max(1, submission.jobs));
}

std::string Absolute(const std::filesystem::path& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

std::filesystem::path WriteScript(const Submission& submission, const std::string& name,
                                  const std::string& text) {
  RequirePlainPath(submission.folder);
  const auto folder = submission.folder / "submit";
  core::MakeFolder(folder);
  core::WriteFileAtomically(folder / name, text);
  return folder / name;
}

pid_t Start(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t process = 0;
  const int error =
      ::posix_spawnp(&process, arguments[0], nullptr, nullptr, arguments.data(), environ);
  if (error != 0)
    throw DeviceError(fmt::format("{} cannot be started: {}; end other programs, or install it",
                                  words[0], std::strerror(error)));
  return process;
}

// The exit code; of a process that a signal ended 128 and the signal's number, as shells say.
int CodeOf(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

// "0-3,7,9-11", as sbatch takes it.
std::string Ranges(const std::vector<int>& numbers) {
  std::vector<std::string> ranges;
  for (std::size_t first = 0, end = 0; first < numbers.size(); first = end) {
    for (end = first + 1; end < numbers.size() && numbers[end] == numbers[end - 1] + 1; ++end) {
    }
    ranges.push_back(end == first + 1 ? fmt::format("{}", numbers[first])
                                      : fmt::format("{}-{}", numbers[first], numbers[end - 1]));
  }
  return fmt::format("{}", fmt::join(ranges, ","));
}

}  // namespace

Need NeedOf(const std::vector<ShardStatus>& all) {
  Need need;
  for (const ShardStatus& status : all) {
    if (status.state != State::kDone) continue;
    need.wall_s = std::max(need.wall_s, status.wall_s);
    need.peak_mib = std::max(need.peak_mib, status.peak_mib);
  }
  return need;
}

std::vector<int> RunHere(const Submission& submission) {
  std::map<pid_t, int> running;
  std::vector<int> failed;
  core::Progress progress("shards", submission.shards.size());
  std::size_t next = 0;
  while (next < submission.shards.size() || !running.empty()) {
    const bool stop = core::InterruptCount() > 0;
    if (stop && running.empty()) core::ThrowIfInterrupted();
    if (!stop && next < submission.shards.size() &&
        running.size() < static_cast<std::size_t>(submission.jobs)) {
      const int number = submission.shards[next++];
      running[Start({submission.program.string(), "shard", "run", submission.folder.string(),
                     std::to_string(number), "--quiet", "--threads",
                     std::to_string(ThreadsOf(submission))})] = number;
      continue;
    }
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, 0);
    if (ended < 0 && errno == EINTR) continue;
    if (ended < 0)
      throw DeviceError(fmt::format("cannot wait for a shard: {}; see `luxfield shard status {}`",
                                    std::strerror(errno), submission.folder.string()));
    const auto process = running.find(ended);
    if (process == running.end()) continue;
    if (CodeOf(status) != 0) failed.push_back(process->second);
    running.erase(process);
    progress.Advance();
  }
  std::sort(failed.begin(), failed.end());
  return failed;
}

std::filesystem::path WriteParallelScript(const Submission& submission) {
  const std::string folder = Quoted(Absolute(submission.folder)),
                    program = Quoted(submission.program.string());
  std::string text = fmt::format(
      "#!/bin/sh\n"
      "# The shards of the luxfield job in {0}, {1} at once, and then the whole.\n"
      "# Written by `luxfield shard submit --engine parallel`. Shards that are done are not done "
      "again.\n"
      "export program={2}\n"
      "export job={0}\n"
      // GNU parallel hands its words to a shell, whatever is in them.
      "one='\"$program\" shard run \"$job\" {{}} --quiet --threads {3}'\n"
      "shards() {{\n"
      "  cat <<'END'\n",
      folder, submission.jobs, program, ThreadsOf(submission));
  for (const int number : submission.shards) text += fmt::format("{}\n", number);
  text += fmt::format(
      "END\n"
      "}}\n"
      "if parallel --version 2>/dev/null | grep -q '^GNU parallel'; then\n"
      "  shards | parallel --jobs {0} --retries 3 \"$one\"\n"
      "else\n"
      "  shards | xargs -P {0} -I {{}} sh -c \"$one\"\n"
      "fi &&\n"
      "  \"$program\" shard gather \"$job\" --quiet\n",
      submission.jobs);
  return WriteScript(submission, "parallel.sh", text);
}

std::filesystem::path WriteSlurmScripts(const Submission& submission, const Need& need) {
  const std::string folder = Quoted(Absolute(submission.folder)),
                    program = Quoted(submission.program.string());
  const int threads = submission.threads > 0 ? submission.threads : 1;
  std::string limits;
  if (need.wall_s > 0) {
    // Half as much again as the most demanding shard so far took, and room for a slow disk.
    const int minutes = static_cast<int>(std::ceil(1.5 * need.wall_s / 60)) + 5,
              mib = static_cast<int>(std::ceil(1.5 * need.peak_mib)) + 256;
    limits = fmt::format(
        "# The most demanding shard that is done took {:.0f} s and {:.0f} MiB.\n"
        "#SBATCH --time={}\n"
        "#SBATCH --mem={}M\n",
        need.wall_s, need.peak_mib, minutes, mib);
  } else {
    limits =
        "# No shard is done yet: do one with `luxfield shard run` and submit again, and time and\n"
        "# memory stand here.\n";
  }
  const std::string head =
      "#!/bin/sh\n"
      "# Written by `luxfield shard submit --engine slurm`.\n";
  WriteScript(
      submission, "shards.sbatch",
      head +
          fmt::format("# One task of the array is one shard. A task that is requeued, or "
                      "submitted twice, does nothing\n"
                      "# where its shard is there.\n"
                      "#SBATCH --job-name=luxfield-shards\n"
                      "#SBATCH --array={}\n"
                      "#SBATCH --cpus-per-task={}\n"
                      "#SBATCH --requeue\n"
                      "#SBATCH --open-mode=append\n"
                      "#SBATCH --output=shard-%a.log\n"
                      "{}"
                      "code=1\n"
                      "for try in 1 2 3; do\n"
                      "  {} shard run {} \"$SLURM_ARRAY_TASK_ID\" --quiet --threads {} && exit 0\n"
                      "  code=$?\n"
                      "  [ $code != 2 ] || break  # what is wrong with an input stays wrong\n"
                      "done\n"
                      "exit $code\n",
                      Ranges(submission.shards), threads, limits, program, folder, threads));
  WriteScript(submission, "gather.sbatch",
              head + fmt::format("# Runs when all shards of the array are done.\n"
                                 "#SBATCH --job-name=luxfield-gather\n"
                                 "#SBATCH --requeue\n"
                                 "#SBATCH --open-mode=append\n"
                                 "#SBATCH --output=gather.log\n"
                                 "exec {} shard gather {} --quiet\n",
                                 program, folder));
  return WriteScript(
      submission, "slurm.sh",
      head +
          fmt::format("# The array of shards, and after it what gathers them, which is cancelled "
                      "where a shard fails:\n"
                      "# `luxfield shard status` says why.\n"
                      "set -e\n"
                      "cd {}/submit  # where the logs go\n"
                      "array=$(sbatch --parsable shards.sbatch)\n"
                      "array=${{array%%;*}}\n"
                      "gather=$(sbatch --parsable --kill-on-invalid-dep=yes \\\n"
                      "  --dependency=\"afterok:$array\" gather.sbatch)\n"
                      "echo \"array $array, gather ${{gather%%;*}}\"\n",
                      folder));
}

int RunScript(const std::filesystem::path& script) {
  const pid_t process = Start({"/bin/sh", Absolute(script)});
  int status = 0;
  while (::waitpid(process, &status, 0) < 0)
    if (errno != EINTR)
      throw DeviceError(script.string() + ": cannot be waited for; run it by hand");
  return CodeOf(status);
}

bool IsOnPath(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && ::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace luxfield::shard
