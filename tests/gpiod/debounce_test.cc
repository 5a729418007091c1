#include "luxfield/hal/drivers/gpiod/debounce.h"

#include <gtest/gtest.h>

#include <random>

namespace luxfield::hal::gpiod {
namespace {

TEST(Debounce, TripsAfterTheAssertTimeAndReleasesAfterTheReleaseTime) {
  Debounce contact(0.002, 0.05, false);
  EXPECT_FALSE(contact.Update(true, 1.0));
  ASSERT_TRUE(contact.Next());
  EXPECT_DOUBLE_EQ(*contact.Next(), 1.002);
  EXPECT_TRUE(contact.Update(true, 1.002));
  EXPECT_FALSE(contact.Next());
  EXPECT_TRUE(contact.Update(false, 2.0));
  EXPECT_DOUBLE_EQ(contact.Next().value(), 2.05);
  EXPECT_FALSE(contact.Update(false, 2.05));
  EXPECT_FALSE(contact.Next());
}

TEST(Debounce, IgnoresASpike) {
  Debounce contact(0.002, 0.05, false);
  contact.Update(true, 1.0);
  contact.Update(false, 1.0001);
  EXPECT_DOUBLE_EQ(contact.Next().value(), 1.0021);
  EXPECT_FALSE(contact.Update(false, 1.0021));
  EXPECT_FALSE(contact.Next());
  // Long after, another one is a new spike, not the second bounce of the first.
  EXPECT_FALSE(contact.Update(true, 5.0));
}

TEST(Debounce, ALooseWireDoesNotRelease) {
  Debounce contact(0.002, 0.05, true);
  for (int k = 0; k < 100; ++k) EXPECT_TRUE(contact.Update(k % 2 != 0, 1 + 0.04 * k));
}

TEST(Debounce, TripsWithinTheAssertTimeOfTheFirstEdgeHoweverItBounces) {
  const unsigned seed = 20261;
  SCOPED_TRACE(seed);
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> gap(1e-5, 1.9e-3);
  for (int trial = 0; trial < 1000; ++trial) {
    Debounce contact(0.002, 0.05, false);
    // Bounces, never inactive for as long as 2 ms, looked at on each edge.
    double now = 0, tripped = -1;
    bool level = true;
    while (now < 0.01 && tripped < 0) {
      if (contact.Update(level, now)) tripped = now;
      now += gap(generator);
      level = !level;
    }
    ASSERT_GE(tripped, 0.002);
    // It is looked at when the contact is active again: one gap of each level later at most.
    ASSERT_LE(tripped, 0.002 + 2 * 1.9e-3);
  }
}

}  // namespace
}  // namespace luxfield::hal::gpiod
