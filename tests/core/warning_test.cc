#include "luxfield/core/warning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace luxfield::core {
namespace {

std::string Printed(const std::function<void()>& work) {
  testing::internal::CaptureStderr();
  work();
  return testing::internal::GetCapturedStderr();
}

TEST(Warning, IsPrintedOnce) {
  EXPECT_EQ(Printed([] {
              Warn("the lamp is warm");
              Warn("the lamp is warm");
              Warn("the lamp is cold");
            }),
            "luxfield: warning: the lamp is warm\nluxfield: warning: the lamp is cold\n");
}

TEST(Warning, LengthsInMillimetresAreSuspect) {
  EXPECT_EQ(Printed([] {
              SuspectLength("plan.toml", "ds_m", 0.5, 0.5);
              SuspectLength("plan.toml", "s0_m", -0.5, 0.5);
            }),
            "");
  const std::string printed = Printed([] { SuspectLength("plan.toml", "s0_m", -6, 0.5); });
  for (const char* part : {"plan.toml", "s0_m = -6 m", "0.5 m", "metres?"})
    EXPECT_THAT(printed, testing::HasSubstr(part));
}

}  // namespace
}  // namespace luxfield::core
