#include "luxfield/core/warning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/execution.h"

namespace luxfield::core {
namespace {

TEST(Warning, LengthsInMillimetresAreSuspect) {
  std::vector<std::string> said;
  const Execution heard{.message = [&](Severity severity, const std::string& message) {
    EXPECT_EQ(severity, Severity::kWarning);
    said.push_back(message);
  }};
  RunWith(heard, [] {
    SuspectLength("plan.toml", "ds_m", 0.5, 0.5);
    SuspectLength("plan.toml", "s0_m", -0.5, 0.5);
  });
  EXPECT_THAT(said, testing::IsEmpty());
  RunWith(heard, [] { SuspectLength("plan.toml", "s0_m", -6, 0.5); });
  ASSERT_EQ(said.size(), 1);
  for (const char* part : {"plan.toml", "s0_m = -6 m", "0.5 m", "metres?"})
    EXPECT_THAT(said[0], testing::HasSubstr(part));
}

}  // namespace
}  // namespace luxfield::core
