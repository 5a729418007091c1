// What `luxfield bench` takes where nothing is named: files of the tree.
#include <gtest/gtest.h>

#include <regex>

#include "program.h"

namespace luxfield::e2e {
namespace {

TEST(BenchDefaults, LabsAndPlansAreFilesOfTheTree) {
  const auto folder = FreshFolder("bench_defaults");
  for (const char* bench : {"errors", "filters"}) {
    const Outcome help = RunLuxfield({"bench", bench, "--help"}, folder);
    ASSERT_EQ(help.exit_code, 0) << help.err;
    for (const char* option : {"lab", "plan"}) {
      std::smatch found;
      ASSERT_TRUE(std::regex_search(help.out, found,
                                    std::regex("--" + std::string(option) + " TEXT=(\\S+)")))
          << bench << ' ' << option;
      EXPECT_TRUE(std::filesystem::is_regular_file(SourceFile(found[1]))) << found[0];
    }
  }
}

}  // namespace
}  // namespace luxfield::e2e
