// Files of other people that tests use where they are at hand: in the folder $LUXFIELD_TEST_DATA,
// or in shared/data beside the repository.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace luxfield::testdata {

inline std::filesystem::path Folder() {
  const char* folder = std::getenv("LUXFIELD_TEST_DATA");
  return folder ? std::filesystem::path(folder)
                : std::filesystem::path(LUXFIELD_SOURCE_DIR) / "../shared/data";
}

// Whether $LUXFIELD_REQUIRE_DATA asks for it.
inline bool IsRequired() {
  const char* required = std::getenv("LUXFIELD_REQUIRE_DATA");
  return required && *required && std::string(required) != "0";
}

inline void PrintSkipped(const std::filesystem::path& absent) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::printf("SKIPPED: %s.%s: no test data: %s is absent\n", test->test_suite_name(), test->name(),
              absent.c_str());
}

}  // namespace luxfield::testdata

// Ends a test where a file or folder of the test data is absent: it fails if they are required,
// else it is skipped, with a line that ./run test counts and shows at its end.
#define LUXFIELD_NEEDS_DATA(file)                                           \
  do {                                                                      \
    if (std::filesystem::exists(file)) break;                               \
    if (luxfield::testdata::IsRequired()) FAIL() << (file) << " is absent"; \
    luxfield::testdata::PrintSkipped(file);                                 \
    GTEST_SKIP() << (file) << " is absent";                                 \
  } while (false)
