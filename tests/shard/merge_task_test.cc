// Positions of a session merged apart are, to the byte, the merge of the whole.
#include "luxfield/shard/merge_task.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "luxfield/capture/take/capture.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/session/session_store.h"
#include "luxfield/shard/gather.h"
#include "luxfield/shard/run_shard.h"
#include "tests/core/memory_folder.h"
#include "tests/e2e/tiny_session.h"
#include "tests/shard/fake_task.h"

namespace luxfield::shard {
namespace {

class MergeShards : public testing::Test {
 protected:
  MergeShards() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~MergeShards() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      MemoryFolder() / fmt::format("luxfield-merge-shards-{}", getpid());
  const std::filesystem::path session_ = folder_ / "session";
};

TEST_F(MergeShards, GatherToTheBytesOfTheWhole) {
  hal::Devices devices =
      hal::sim::SimulatedLab(core::Config::FromString(e2e::TinyLab(1, 0), "lab.toml"))
          .MakeDevices();
  capture::RunCapture(capture::ReadPlan(core::Config::FromString(e2e::TinyPlan(3, 2), "plan.toml")),
                      devices, session_);
  const auto whole = folder_ / "whole.meas.exr";
  reconstruct::MergeSessionToFile(session::SessionReader(session_), whole);

  const MergeTask task(session_, folder_ / "joined.meas.exr", {});
  EXPECT_EQ(task.Length(), 6);
  for (const int shards : {1, 4}) {
    const auto job_folder = folder_ / fmt::format("job{}", shards);
    WriteJob(job_folder, MakeJob("merge", {}, task, shards));
    const Job job = ReadJob(job_folder);
    for (int n = 0; n < shards; ++n) RunShard(job_folder, job, task, n);
    Gather(job_folder, job, task);
    EXPECT_TRUE(BytesOf(task.Outputs()[0]) == BytesOf(whole)) << shards << " shards";
  }
}

// A calibration that changes between the shards would give positions that do not go together.
TEST_F(MergeShards, AreOfTheSessionAndItsCalibrations) {
  reconstruct::MergeSessionOptions how;
  how.calibrations = {"sensor.cal.json", "glare.cal.json"};
  how.flat_field = "lens.flat.exr";
  EXPECT_THAT(MergeTask(session_, "out.meas.exr", how).Inputs(),
              testing::UnorderedElementsAre(session_ / "plan.json", session_ / "session.json",
                                            session_ / "journal.jsonl", "sensor.cal.json",
                                            "glare.cal.json", "lens.flat.exr"));
  how.flat_field.clear();
  how.calibrations.clear();
  EXPECT_EQ(MergeTask(session_, "out.meas.exr", how).Inputs().size(), 3u);
}

}  // namespace
}  // namespace luxfield::shard
