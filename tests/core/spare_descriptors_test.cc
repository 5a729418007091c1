#include "luxfield/core/spare_descriptors.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace luxfield::core {
namespace {

TEST(SpareDescriptors, AreCountedUpToTheLimitAndGivenBack) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  ASSERT_GE(before.rlim_cur, 100u);
  EXPECT_EQ(SpareDescriptors(24), 24);
  rlimit few = before;
  few.rlim_cur = 20;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  const int spare = SpareDescriptors(24), again = SpareDescriptors(24);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_LE(spare, 17);  // beside the three standard streams
  EXPECT_GE(spare, 1);
  EXPECT_EQ(again, spare);
}

}  // namespace
}  // namespace luxfield::core
