// A job of the fake task in a folder of the test's own.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/shard/job_folder.h"
#include "tests/core/memory_folder.h"
#include "tests/shard/fake_task.h"

namespace luxfield::shard {

// What the InputError or DeviceError that `work` throws says; empty where it throws none.
template <typename Work>
std::string SentenceOf(Work&& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

class ShardJob : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = MemoryFolder() /
              fmt::format("luxfield-shard-{}-{}",
                          testing::UnitTest::GetInstance()->current_test_info()->name(), getpid());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path JobFolder() const { return folder_ / "job"; }

  Job Plan(const FakeTask& task, int shards) const {
    const Job job = MakeJob("fake", {"word"}, task, shards);
    WriteJob(JobFolder(), job);
    return ReadJob(JobFolder());
  }
  std::string Whole(const FakeTask& task) const {
    task.Write(folder_ / "whole.exr", 0, task.Length());
    return BytesOf(folder_ / "whole.exr");
  }
  std::filesystem::path PieceOf(const FakeTask& task, const Job& job, int number) const {
    return PieceFiles(JobFolder(), job.shards[number], task)[0];
  }

  std::filesystem::path folder_;
};

}  // namespace luxfield::shard
