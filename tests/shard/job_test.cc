// A job on disk: what is done once, what is missing, failed, damaged, killed, done twice at once.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <set>
#include <thread>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/shard/gather.h"
#include "luxfield/shard/job_file.h"
#include "luxfield/shard/run_shard.h"
#include "luxfield/shard/scratch.h"
#include "luxfield/shard/status.h"
#include "tests/seed.h"
#include "tests/shard/job_fixture.h"

namespace luxfield::shard {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(ShardJob, AnyNumberOfShardsGathersToTheWholesBytes) {
  const FakeTask task(folder_, 23);
  for (const int shards : {1, 2, 7, 23, 100}) {
    const Job job = Plan(task, shards);
    EXPECT_EQ(job.shards.size(), static_cast<std::size_t>(std::min(shards, 23)));
    for (int n = static_cast<int>(job.shards.size()) - 1; n >= 0; --n)
      EXPECT_FALSE(RunShard(JobFolder(), job, task, n).was_there);
    Gather(JobFolder(), job, task);
    EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task)) << shards << " shards";
    std::filesystem::remove_all(JobFolder());
  }
}

TEST_F(ShardJob, ShardsAreCutAtTheGrain) {
  FakeTask task(folder_, 23);
  task.grain = 5;
  const Job job = Plan(task, 3);
  std::vector<int> cuts;
  for (const PlannedShard& shard : job.shards) cuts.push_back(shard.last);
  EXPECT_THAT(cuts, ElementsAre(5, 15, 23));
}

TEST_F(ShardJob, AWholeShardIsNotDoneAgain) {
  const FakeTask task(folder_, 6);
  const Job job = Plan(task, 2);
  RunShard(JobFolder(), job, task, 1);
  const ShardRun again = RunShard(JobFolder(), job, task, 1);
  EXPECT_TRUE(again.was_there);
  EXPECT_EQ(again.manifest.figures.at("first"), 3);
  EXPECT_EQ(task.runs, 1);
}

// By which `shard submit` asks a cluster for time and memory.
TEST_F(ShardJob, AShardSaysWhatItTook) {
  constexpr std::size_t kMib = 80;
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  task.before_write = [](int) {
    std::vector<char> touched(kMib << 20, 1);
    usleep(20000);
    EXPECT_EQ(touched[touched.size() / 2], 1);
  };
  RunShard(JobFolder(), job, task, 0);
  const ShardStatus status = StatusOf(JobFolder(), job)[0];
  EXPECT_GE(status.peak_mib, double{kMib});
  EXPECT_GE(status.wall_s, 0.02);
}

TEST_F(ShardJob, PlanningAgainChangesNothingAndAnotherJobIsRefused) {
  const FakeTask task(folder_, 6);
  Plan(task, 2);
  const std::string bytes = BytesOf(JobFolder() / "job.json");
  Plan(task, 2);
  EXPECT_EQ(BytesOf(JobFolder() / "job.json"), bytes);
  EXPECT_THAT(SentenceOf([&] { Plan(task, 3); }),
              AllOf(HasSubstr("holds another job"), HasSubstr("another folder")));
  core::WriteFileAtomically(task.input, "others!");
  EXPECT_THAT(SentenceOf([&] { Plan(task, 2); }), HasSubstr("holds another job"));
}

TEST_F(ShardJob, MissingShardsAreNamed) {
  const FakeTask task(folder_, 8);
  const Job job = Plan(task, 4);
  RunShard(JobFolder(), job, task, 2);
  EXPECT_THAT(SentenceOf([&] { Gather(JobFolder(), job, task); }),
              AllOf(HasSubstr("3 of 4 shards are missing: 0, 1, 3"), HasSubstr("shard run")));
  EXPECT_FALSE(std::filesystem::exists(task.Outputs()[0]));
}

TEST_F(ShardJob, ADamagedShardIsNamedAndDoneAgain) {
  const FakeTask task(folder_, 8);
  const Job job = Plan(task, 2);
  for (const int n : {0, 1}) RunShard(JobFolder(), job, task, n);
  const auto piece = PieceOf(task, job, 1);
  std::string bytes = BytesOf(piece);
  bytes[bytes.size() / 2] ^= 1;
  core::WriteFileAtomically(piece, bytes);
  EXPECT_THAT(SentenceOf([&] { Gather(JobFolder(), job, task); }),
              AllOf(HasSubstr(piece.string()), HasSubstr("is damaged"), HasSubstr("run")));
  EXPECT_EQ(StatusOf(JobFolder(), job)[1].state, State::kDone);
  EXPECT_EQ(StatusOf(JobFolder(), job, &task)[1].state, State::kDamaged);

  bytes.resize(bytes.size() - 1);
  core::WriteFileAtomically(piece, bytes);
  EXPECT_EQ(StatusOf(JobFolder(), job)[1].state, State::kDamaged);
  EXPECT_FALSE(RunShard(JobFolder(), job, task, 1).was_there);
  Gather(JobFolder(), job, task);
  EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task));
}

TEST_F(ShardJob, AManifestThatCannotBeReadVouchesForNothing) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 1);
  RunShard(JobFolder(), job, task, 0);
  core::WriteFileAtomically(ManifestFile(JobFolder(), job.shards[0]), "{\"files\": [");
  EXPECT_EQ(StatusOf(JobFolder(), job)[0].state, State::kMissing);
  EXPECT_FALSE(RunShard(JobFolder(), job, task, 0).was_there);
}

TEST_F(ShardJob, AFailureLeavesItsSentenceUntilItIsMended) {
  FakeTask task(folder_, 8);
  const Job job = Plan(task, 2);
  task.before_write = [](int) { throw InputError("lamp.exr", "is dark", "light it"); };
  EXPECT_THAT(SentenceOf([&] { RunShard(JobFolder(), job, task, 0); }),
              "lamp.exr: is dark; light it");
  ShardStatus status = StatusOf(JobFolder(), job)[0];
  EXPECT_EQ(status.state, State::kFailed);
  EXPECT_EQ(status.sentence, "lamp.exr: is dark; light it");
  EXPECT_EQ(FindFailure(JobFolder(), job.shards[0])->exit_code, 2);
  task.before_write = {};
  RunShard(JobFolder(), job, task, 0);
  EXPECT_EQ(StatusOf(JobFolder(), job)[0].state, State::kDone);
  EXPECT_FALSE(FindFailure(JobFolder(), job.shards[0]));
}

TEST_F(ShardJob, ChangedInputsAreNoticedAndTouchedOnesAreNot) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 1);
  core::WriteFileAtomically(task.input, "numbers");  // the same, at another time
  RunShard(JobFolder(), job, task, 0);
  core::WriteFileAtomically(task.input, "letters");
  const std::string sentence = SentenceOf([&] { Gather(JobFolder(), job, task); });
  EXPECT_THAT(sentence, AllOf(HasSubstr("input.txt"), HasSubstr("has changed since")));
}

TEST_F(ShardJob, NumbersThatItDoesNotHaveAreRefused) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  for (const int number : {-1, 2})
    EXPECT_THAT(SentenceOf([&] { RunShard(JobFolder(), job, task, number); }),
                HasSubstr("numbered 0 to 1"));
}

TEST_F(ShardJob, AChangedJobFileIsRefused) {
  const FakeTask task(folder_, 4);
  Plan(task, 2);
  core::Json json = core::ReadJson(JobFolder() / "job.json");
  json["words"] = {"another"};
  core::WriteJson(JobFolder() / "job.json", json);
  EXPECT_THAT(SentenceOf([&] { ReadJob(JobFolder()); }), HasSubstr("the file was changed"));
  EXPECT_THAT(SentenceOf([&] { ReadJob(folder_); }), HasSubstr("holds no job"));
}

// Pieces of machines that round otherwise, or name another device.
TEST_F(ShardJob, PiecesThatStateOtherThingsAreNotJoined) {
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  RunShard(JobFolder(), job, task, 0);
  task.made_by = "another device";
  RunShard(JobFolder(), job, task, 1);
  EXPECT_THAT(
      SentenceOf([&] { Gather(JobFolder(), job, task); }),
      AllOf(HasSubstr("differs from"), HasSubstr("made_by ('a test' and 'another device')")));
  EXPECT_FALSE(std::filesystem::exists(task.Outputs()[0]));
}

TEST_F(ShardJob, TwoAtOnceGiveOneWholeShard) {
  FakeTask task(folder_, 40);
  const Job job = Plan(task, 1);
  constexpr int kProcesses = 4;
  std::vector<pid_t> processes;
  for (int k = 0; k < kProcesses; ++k) {
    const pid_t process = fork();
    if (process == 0) {
      task.before_write = [](int) { usleep(20000); };
      try {
        RunShard(JobFolder(), job, task, 0);
        _exit(0);
      } catch (const std::exception&) {
        _exit(1);
      }
    }
    processes.push_back(process);
  }
  for (const pid_t process : processes) {
    int status = 0;
    ASSERT_EQ(waitpid(process, &status, 0), process);
    EXPECT_EQ(status, 0);
  }
  Gather(JobFolder(), job, task);
  EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task));
  EXPECT_TRUE(FindScratch(JobFolder()).empty());
}

// A process that does all shards is killed at a random step of its writing, over and over.
TEST_F(ShardJob, KilledAtAnyStepNothingIsLostAndNothingWrong) {
  core::Random random(TestSeed(11), 0);
  const FakeTask task(folder_, 12);
  const Job job = Plan(task, 4);
  int killed = 0;
  for (int round = 0; round < 40; ++round) {
    const std::uint32_t die_at = random() % 12;
    const pid_t process = fork();
    if (process == 0) {
      std::uint32_t steps = 0;
      core::SetStorageHookForTest([&](std::string_view) {
        if (steps++ == die_at) raise(SIGKILL);
      });
      const std::uint32_t number = random() % 4;
      std::filesystem::remove(ManifestFile(JobFolder(), job.shards[number]));
      RunShard(JobFolder(), job, task, static_cast<int>(number));
      _exit(0);
    }
    random();  // as the child has drawn
    int status = 0;
    ASSERT_EQ(waitpid(process, &status, 0), process);
    killed += WIFSIGNALED(status);
    for (const ShardStatus& one : StatusOf(JobFolder(), job, &task))
      EXPECT_NE(one.state, State::kDamaged) << one.sentence;
  }
  std::printf("%d of 40 runs killed\n", killed);
  EXPECT_GT(killed, 5);
  std::set<State> states;
  for (const ShardStatus& one : StatusOf(JobFolder(), job, &task)) states.insert(one.state);
  for (int n = 0; n < 4; ++n) RunShard(JobFolder(), job, task, n);
  Gather(JobFolder(), job, task);
  EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task));
  for (const Scratch& scratch : FindScratch(JobFolder())) EXPECT_TRUE(scratch.alive);
}

// Also where the next run finds nothing to do.
TEST_F(ShardJob, ScratchOfAShardKilledOnceItWasWholeGoes) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const pid_t process = fork();
  if (process == 0) {
    core::SetStorageHookForTest([&](std::string_view) {
      if (std::filesystem::exists(ManifestFile(JobFolder(), job.shards[1]))) raise(SIGKILL);
    });
    RunShard(JobFolder(), job, task, 1);
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(process, &status, 0), process);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(FindScratch(JobFolder()).empty());
  EXPECT_TRUE(RunShard(JobFolder(), job, task, 1).was_there);
  EXPECT_TRUE(FindScratch(JobFolder()).empty());
}

TEST_F(ShardJob, StatusTellsWhoWasKilled) {
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const pid_t process = fork();
  if (process == 0) {
    task.before_write = [](int) { raise(SIGKILL); };
    RunShard(JobFolder(), job, task, 1);
    _exit(0);
  }
  waitpid(process, nullptr, 0);
  const auto all = StatusOf(JobFolder(), job);
  EXPECT_EQ(all[0].state, State::kMissing);
  EXPECT_EQ(all[1].state, State::kKilled);
  EXPECT_THAT(all[1].sentence, HasSubstr(fmt::format("process {} on", process)));
  EXPECT_THAT(NotDone(all), ElementsAre(0, 1));
}

// A file that may not grow is what a full disk is to who writes it.
TEST_F(ShardJob, AFullDiskIsSaidAndLeavesNothing) {
  FakeTask task(folder_, 3000);
  const Job job = Plan(task, 1);
  const pid_t process = fork();
  if (process == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      RunShard(JobFolder(), job, task, 0);
    } catch (const DeviceError&) {
      _exit(3);
    }
    _exit(0);
  }
  int status = 0;
  waitpid(process, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 3);
  const ShardStatus one = StatusOf(JobFolder(), job)[0];
  EXPECT_EQ(one.state, State::kFailed);
  EXPECT_THAT(one.sentence, HasSubstr("cannot write"));
  EXPECT_TRUE(FindScratch(JobFolder()).empty());
  EXPECT_FALSE(std::filesystem::exists(PieceOf(task, job, 0)));
}

TEST_F(ShardJob, AFolderThatIsNoneIsSaid) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 1);
  core::WriteFileAtomically(JobFolder() / "scratch", "a file");
  EXPECT_THAT(SentenceOf([&] { RunShard(JobFolder(), job, task, 0); }), HasSubstr("scratch"));
}

TEST(ShardJobFile, SaysWhatIsWrong) {
  const auto folder = MemoryFolder() / fmt::format("luxfield-jobs-{}", getpid());
  std::filesystem::create_directories(folder);
  const auto read = [&](const std::string& text) {
    core::WriteFileAtomically(folder / "job.toml", text);
    return SentenceOf([&] { ReadJobFile(folder / "job.toml"); });
  };
  EXPECT_THAT(read("verb = 'merge'\n"), HasSubstr("job is missing; add a table [job]"));
  EXPECT_THAT(read("[job]\nverb = 'merge'\ninput = 's'\noutput = 'x'\n"),
              HasSubstr("job.shards is missing"));
  EXPECT_THAT(read("[job]\nverb = 'merge'\ninput = 's'\noutput = 'x'\nshards = 0\n"),
              HasSubstr("job.shards = 0 must lie in [1, 100000]"));
  EXPECT_THAT(read("[job]\nverb = 'merge'\ninput = []\noutput = 'x'\nshards = 2\n"),
              HasSubstr("job.input names nothing"));
  EXPECT_EQ(read("[job]\nverb = 'merge'\ninput = 's'\noutput = '../x'\nshards = 2\n"), "");
  const JobFile job = ReadJobFile(folder / "job.toml");
  EXPECT_EQ(job.inputs.at(0), folder / "s");
  EXPECT_EQ(job.output, folder.parent_path() / "x");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::shard
