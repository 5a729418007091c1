#include "luxfield/core/nearest.h"

#include <gtest/gtest.h>

#include <vector>

namespace luxfield::core {
namespace {

const std::vector<std::string> kWords = {"render", "report", "reconstruct", "plan", "merge"};

TEST(Nearest, FindsOneEditOfEachKind) {
  EXPECT_EQ(Nearest("rendr", kWords), "render");    // left out
  EXPECT_EQ(Nearest("rennder", kWords), "render");  // inserted
  EXPECT_EQ(Nearest("plam", kWords), "plan");       // replaced
  EXPECT_EQ(Nearest("erport", kWords), "report");   // swapped
  EXPECT_EQ(Nearest("merge", kWords), "merge");
}

TEST(Nearest, SuggestsNothingFarAway) {
  EXPECT_EQ(Nearest("photometry", kWords), std::nullopt);
  EXPECT_EQ(Nearest("shard", kWords), std::nullopt);
  EXPECT_EQ(Nearest("", kWords), std::nullopt);
  EXPECT_EQ(Nearest("render", {}), std::nullopt);
}

TEST(Nearest, PrefersTheSmallestDistance) {
  const std::vector<std::string> words = {"delta_cm", "delta_m", "delta"};
  EXPECT_EQ(Nearest("delta_mm", words), "delta_cm");  // as near as delta_m and first
  EXPECT_EQ(Nearest("delta_", words), "delta_m");
}

}  // namespace
}  // namespace luxfield::core
