// Folders of those who work on a shard, in containers of equal names and numbers, too.
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <csignal>

#include "luxfield/shard/gather.h"
#include "luxfield/shard/run_shard.h"
#include "luxfield/shard/scratch.h"
#include "luxfield/shard/status.h"
#include "tests/shard/job_fixture.h"

namespace luxfield::shard {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// As two containers have them.
TEST_F(ShardJob, TwoRunnersOfEqualHostAndProcessKeepApart) {
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 1);
  FakeTask other(folder_, 4);
  task.before_write = [&](int) {
    EXPECT_FALSE(RunShard(JobFolder(), job, other, 0).was_there);
    EXPECT_THAT(FindScratch(JobFolder()), SizeIs(1));
  };
  EXPECT_FALSE(RunShard(JobFolder(), job, task, 0).was_there);
  EXPECT_THAT(FindScratch(JobFolder()), IsEmpty());
  Gather(JobFolder(), job, task);
  EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task));
}

// A number that no process has here: in another container one may.
TEST_F(ShardJob, ARunnerIsAliveWhoseProcessIsNotSeenHere) {
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  const FakeTask other(folder_, 4);
  task.before_write = [&](int) {
    const std::filesystem::path own = FindScratch(JobFolder())[0].folder,
                                elsewhere = own.parent_path() /
                                            fmt::format("0.{}.{}-abcdef", HostName(), gone);
    std::filesystem::rename(own, elsewhere);
    EXPECT_EQ(StatusOf(JobFolder(), job)[0].state, State::kRunning);
    RunShard(JobFolder(), job, other, 1);  // which removes what dead processes left
    ASSERT_THAT(FindScratch(JobFolder()), SizeIs(1));
    EXPECT_EQ(FindScratch(JobFolder())[0].process, gone);
    std::filesystem::rename(elsewhere, own);
  };
  RunShard(JobFolder(), job, task, 0);
  EXPECT_THAT(FindScratch(JobFolder()), IsEmpty());
}

// Nobody holds its lock: who has its number is another process.
TEST_F(ShardJob, ARunnerIsDeadWhoseNumberIsAnotherProcesss) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const auto left = JobFolder() / "scratch" / fmt::format("1.{}.{}-abcdef", HostName(), getpid());
  std::filesystem::create_directories(left);
  core::WriteFileAtomically(left / "LOCK", "");
  EXPECT_EQ(StatusOf(JobFolder(), job)[1].state, State::kKilled);
  RunShard(JobFolder(), job, task, 0);
  EXPECT_THAT(FindScratch(JobFolder()), IsEmpty());
}

// Somebody may be about to lock it.
TEST_F(ShardJob, AHiddenScratchFolderStaysForADay) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const auto left = JobFolder() / "scratch" / fmt::format(".1.{}.1-abcdef", HostName());
  std::filesystem::create_directories(left);
  EXPECT_EQ(StatusOf(JobFolder(), job)[1].state, State::kMissing);
  RunShard(JobFolder(), job, task, 0);
  EXPECT_TRUE(std::filesystem::exists(left));
  std::filesystem::last_write_time(
      left, std::filesystem::file_time_type::clock::now() - std::chrono::hours(25));
  RunShard(JobFolder(), job, task, 0);
  EXPECT_FALSE(std::filesystem::exists(left));
}

// Without a lock: the process decides.
TEST_F(ShardJob, WhatADeadProcessOfAnEarlierVersionLeftGoes) {
  const FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  for (const pid_t process : {gone, getpid()})
    std::filesystem::create_directories(JobFolder() / "scratch" /
                                        fmt::format("1.{}.{}", HostName(), process));
  RunShard(JobFolder(), job, task, 0);
  ASSERT_THAT(FindScratch(JobFolder()), SizeIs(1));
  EXPECT_EQ(FindScratch(JobFolder())[0].process, getpid());
}

// Each of the processes is number 1 of its own, on one host.
TEST_F(ShardJob, RunnersInContainersLeaveEachOtherAlone) {
  constexpr int kContainers = 3, kNotPermitted = 77;
  FakeTask task(folder_, 4);
  const Job job = Plan(task, 2);
  std::array<int, 2> at_work{}, go{};
  ASSERT_EQ(pipe(at_work.data()), 0);
  ASSERT_EQ(pipe(go.data()), 0);
  std::vector<pid_t> containers;
  for (int k = 0; k < kContainers; ++k) {
    const pid_t container = fork();
    if (container == 0) {
      close(at_work[0]);
      close(go[1]);
      if (unshare(CLONE_NEWPID) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWPID) != 0)
        _exit(kNotPermitted);
      const pid_t runner = fork();
      if (runner == 0) {
        task.before_write = [&](int) {
          char byte = 0;
          if (write(at_work[1], &byte, 1) != 1 || read(go[0], &byte, 1) != 1) _exit(2);
        };
        try {
          RunShard(JobFolder(), job, task, 0);
          _exit(0);
        } catch (const std::exception& error) {
          std::fprintf(stderr, "%s\n", error.what());
          _exit(1);
        }
      }
      int status = 0;
      waitpid(runner, &status, 0);
      _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 3);
    }
    containers.push_back(container);
  }
  close(at_work[1]);
  close(go[0]);
  char byte = 0;
  int begun = 0;
  while (begun < kContainers && read(at_work[0], &byte, 1) == 1) ++begun;
  if (begun == kContainers) {
    const FakeTask other(folder_, 4);
    RunShard(JobFolder(), job, other, 1);  // which removes what dead processes left
    EXPECT_THAT(FindScratch(JobFolder()), SizeIs(kContainers));
    EXPECT_EQ(StatusOf(JobFolder(), job)[0].state, State::kRunning);
  }
  for (int k = 0; k < kContainers; ++k) EXPECT_EQ(write(go[1], &byte, 1), 1);
  close(go[1]);
  close(at_work[0]);
  int not_permitted = 0;
  for (const pid_t container : containers) {
    int status = 0;
    ASSERT_EQ(waitpid(container, &status, 0), container);
    if (WEXITSTATUS(status) == kNotPermitted)
      ++not_permitted;
    else
      EXPECT_EQ(status, 0);
  }
  if (not_permitted > 0) GTEST_SKIP() << "processes may not have numbers of their own here";
  EXPECT_EQ(begun, kContainers);
  EXPECT_THAT(FindScratch(JobFolder()), IsEmpty());
  Gather(JobFolder(), job, task);
  EXPECT_EQ(BytesOf(task.Outputs()[0]), Whole(task));
}

}  // namespace
}  // namespace luxfield::shard
