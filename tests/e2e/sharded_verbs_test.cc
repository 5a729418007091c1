// From [options] of a job.toml to the words of its verb, and from those to the task.
#include "luxfield/cli/verbs/sharded_verbs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "program.h"

namespace luxfield::e2e {
namespace {

using testing::ElementsAre;

class ShardedVerbs : public testing::Test {
 protected:
  // In the order in which the verb declares its options.
  std::vector<std::string> Words(const std::string& job) const {
    core::WriteFileAtomically(folder_ / "job.toml", job);
    return cli::WordsOf(shard::ReadJobFile(folder_ / "job.toml"));
  }
  std::string In(const std::string& file) const { return (folder_ / file).string(); }

  const std::filesystem::path folder_ =
      FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ShardedVerbs, FilesAreThoseBesideTheJobAndFlagsAreWordsAlone) {
  EXPECT_THAT(Words(R"([job]
verb = "merge"
input = "s"
output = "out.meas.exr"
shards = 2
[options]
calibration = ["left=a.cal.json", "b.cal.json"]
skip-hashes = true
estimate-exposures = false
)"),
              testing::UnorderedElementsAre(In("s"), "--output", In("out.meas.exr"),
                                            "--calibration", "left=" + In("a.cal.json"),
                                            "--calibration", In("b.cal.json"), "--skip-hashes"));
}

TEST_F(ShardedVerbs, ATaskHasTheInputsAndOutputsOfItsWords) {
  const std::vector<std::string> words = Words(R"([job]
verb = "reconstruct"
input = ["a.meas.exr", "b.meas.exr"]
output = "c.lf.exr"
shards = 2
[options]
sigma = "c.sigma.lf.exr"
filter = "a.filter.exr"
keep = "flux"
)");
  const auto task = cli::MakeTask("reconstruct", words, 1);
  EXPECT_THAT(task->Inputs(), testing::UnorderedElementsAre(In("a.meas.exr"), In("b.meas.exr"),
                                                            In("a.filter.exr")));
  EXPECT_THAT(task->Outputs(), ElementsAre(In("c.lf.exr"), In("c.sigma.lf.exr")));
}

// As a job.json may have it that was changed, with names that fit.
TEST_F(ShardedVerbs, WordsThatAskForHelpAreNoneOfAJob) {
  for (const char* verb : {"merge", "reconstruct", "preprocess", "render"}) try {
      cli::MakeTask(verb, {"--help"}, 1);
      ADD_FAILURE() << "took it";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("[options] of")) << verb;
      EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("main function"))) << verb;
    }
}

}  // namespace
}  // namespace luxfield::e2e
