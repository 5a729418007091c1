#include <gtest/gtest.h>

#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::reconstruct {
namespace {

TEST(LampDrift, InterpolatesWithinAnEpochAndHoldsItsEnds) {
  LampDrift drift;
  drift.Add(0, 0, 10, 1.0);
  drift.Add(0, 0, 20, 1.2);
  drift.Add(1, 0, 5, 0.8);
  EXPECT_DOUBLE_EQ(drift.Factor(0, 0, 15), 1.1);
  EXPECT_DOUBLE_EQ(drift.Factor(0, 0, 20), 1.2);
  EXPECT_DOUBLE_EQ(drift.Factor(0, 0, 0), 1.0);
  EXPECT_DOUBLE_EQ(drift.Factor(0, 0, 99), 1.2);
  EXPECT_DOUBLE_EQ(drift.Factor(1, 0, 15), 0.8);
  EXPECT_DOUBLE_EQ(drift.Factor(0, 1, 15), 1.0);  // another channel: not known
}

}  // namespace
}  // namespace luxfield::reconstruct
