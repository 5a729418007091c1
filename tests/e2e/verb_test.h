// A test that runs verbs in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/e2e/program.h"

namespace luxfield::e2e {

class VerbTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Runs a verb that must succeed; returns its --json.
  nlohmann::json Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--json", "figures.json", "--quiet"});
    const Outcome outcome = RunLuxfield(arguments, folder_);
    EXPECT_EQ(outcome.exit_code, 0) << arguments[0] << ": " << outcome.err;
    return outcome.exit_code == 0 ? nlohmann::json::parse(ReadText(folder_ / "figures.json"))
                                  : nlohmann::json::object();
  }

  std::filesystem::path folder_;
};

}  // namespace luxfield::e2e
