// What engines are given: scripts for shells, GNU parallel, xargs and Slurm.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>

#include "luxfield/shard/submit.h"
#include "tests/shard/job_fixture.h"

namespace luxfield::shard {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// All that shells, xargs, GNU parallel and sbatch obey.
constexpr char kHostileName[] =
    "it's \"a\" job; touch x & $(touch x) `touch x` {} {#} %a %j \\ #SBATCH";

class ShardScripts : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    fs::create_directories(job_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path Program(const fs::path& path, const std::string& script) const {
    fs::create_directories(path.parent_path());
    core::WriteFileAtomically(path, "#!/bin/sh\n" + script);
    ::chmod(path.c_str(), 0755);
    return path;
  }
  // Writes its words a line each to `heard`.
  fs::path Listener() const {
    return Program(folder_ / "$(touch x) 'p'/luxfield",
                   fmt::format("printf '%s\\n' \"$@\" >> '{}'\n", (folder_ / "heard").string()));
  }
  // In a folder of its own, with what stands in `programs` before all others.
  int RunWith(const fs::path& programs, const fs::path& script) const {
    const fs::path work = folder_ / "work";
    fs::create_directories(work);
    const std::string path = programs.string() + ":" + std::getenv("PATH");
    return std::system(fmt::format("cd '{}' && PATH='{}' exec /bin/sh \"$(cat '{}')\"",
                                   work.string(), path, Named(script).string())
                           .c_str());
  }
  // A file that holds the path, which no shell has to quote then.
  fs::path Named(const fs::path& script) const {
    core::WriteFileAtomically(folder_ / "script", script.string());
    return folder_ / "script";
  }
  void ExpectShardsOf(std::vector<std::string> words) const {
    std::string heard = BytesOf(folder_ / "heard");
    for (const char* number : {"0", "2"}) {
      const std::string one =
          fmt::format("shard\nrun\n{}\n{}\n--quiet\n--threads\n3\n", job_.string(), number);
      EXPECT_THAT(heard, HasSubstr(one));
    }
    for (const std::string& word : words) EXPECT_THAT(heard, HasSubstr(word));
    EXPECT_TRUE(fs::is_empty(folder_ / "work")) << "something was obeyed";
  }

  const fs::path folder_ = MemoryFolder() / fmt::format("luxfield-scripts-{}", getpid()),
                 job_ = folder_ / kHostileName;
};

TEST_F(ShardScripts, SlurmIsToldArrayDependencyTimeAndMemory) {
  const Submission submission{
      .folder = job_, .program = "/opt/lux field", .shards = {0, 1, 2, 5, 9, 10}};
  const auto script = WriteSlurmScripts(submission, {.wall_s = 600, .peak_mib = 1000});
  const std::string shards = BytesOf(job_ / "submit/shards.sbatch"), start = BytesOf(script);
  for (const char* line :
       {"#SBATCH --array=0-2,5,9-10\n", "#SBATCH --requeue\n", "#SBATCH --time=20\n",
        "#SBATCH --mem=1756M\n", "'/opt/lux field' shard run"})
    EXPECT_THAT(shards, HasSubstr(line));
  EXPECT_THAT(start, HasSubstr("afterok:$array"));
}

// Patterns, quotes and spaces mean something in lines of #SBATCH: the job's path is not in them.
TEST_F(ShardScripts, NoPathIsInTheLinesThatSbatchReads) {
  const Submission submission{
      .folder = job_, .program = Listener(), .shards = {0, 2}, .threads = 3};
  const auto start = WriteSlurmScripts(submission, {});
  for (const char* name : {"shards.sbatch", "gather.sbatch"}) {
    std::istringstream lines(BytesOf(job_ / "submit" / name));
    for (std::string line; std::getline(lines, line);)
      if (line.starts_with("#")) {
        EXPECT_THAT(line, Not(HasSubstr("/submit"))) << "the logs' path";
        EXPECT_THAT(line, Not(HasSubstr("it's")));
      }
  }
  EXPECT_THAT(BytesOf(job_ / "submit/shards.sbatch"), HasSubstr("#SBATCH --output=shard-%a.log\n"));
  // Says where it is, which is where the logs go, and runs what it is given.
  Program(folder_ / "bin/sbatch", "pwd >> '" + (folder_ / "heard").string() +
                                      "'\n"
                                      "for script; do :; done\n"
                                      "for SLURM_ARRAY_TASK_ID in 0 2; do\n"
                                      "  export SLURM_ARRAY_TASK_ID; /bin/sh \"$script\" || exit\n"
                                      "done\n"
                                      "echo 1\n");
  EXPECT_EQ(RunWith(folder_ / "bin", start), 0);
  ExpectShardsOf({(job_ / "submit").string() + "\n", "shard\ngather\n" + job_.string() + "\n"});
}

TEST_F(ShardScripts, XargsAndParallelTakeAPathAsItIs) {
  const Submission submission{
      .folder = job_, .program = Listener(), .shards = {0, 2}, .jobs = 2, .threads = 3};
  const auto script = WriteParallelScript(submission);
  const std::string gather = "shard\ngather\n" + job_.string() + "\n--quiet\n";
  Program(folder_ / "without/parallel", "exit 1\n");
  EXPECT_EQ(RunWith(folder_ / "without", script), 0);
  ExpectShardsOf({gather});
  fs::remove(folder_ / "heard");
  // As GNU parallel does, which puts its words together to a line for a shell.
  Program(folder_ / "with/parallel",
          "[ \"$1\" = --version ] && echo 'GNU parallel 20221122' && exit\n"
          "shift 4\n"
          "while read -r number; do\n"
          "  line=$(printf '%s' \"$*\" | sed \"s/{}/$number/g\")\n"
          "  /bin/sh -c \"$line\" || exit\n"
          "done\n");
  EXPECT_EQ(RunWith(folder_ / "with", script), 0);
  ExpectShardsOf({gather});
}

TEST_F(ShardScripts, APathWithLineBreaksIsRefused) {
  for (const char* name : {"a\ntouch x\n", "a\tb", "a\x1b[0m", "a\x7f"}) {
    const Submission submission{.folder = folder_ / name, .program = "/luxfield", .shards = {0}};
    fs::create_directories(submission.folder);
    EXPECT_THAT(SentenceOf([&] { WriteParallelScript(submission); }), HasSubstr("line breaks"));
    EXPECT_THAT(SentenceOf([&] { WriteSlurmScripts(submission, {}); }), HasSubstr("line breaks"));
    EXPECT_TRUE(fs::is_empty(submission.folder));
    const FakeTask task(folder_, 2);
    EXPECT_THAT(SentenceOf([&] { WriteJob(folder_ / name, MakeJob("fake", {"word"}, task, 1)); }),
                HasSubstr("line breaks"));
    EXPECT_TRUE(fs::is_empty(submission.folder));
  }
}

}  // namespace
}  // namespace luxfield::shard
