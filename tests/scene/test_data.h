// Third-party files that tests use where they are at hand.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace luxfield::testdata {

inline std::filesystem::path Folder() {
  const char* folder = std::getenv("LUXFIELD_TEST_DATA");
  return folder ? std::filesystem::path(folder)
                : std::filesystem::path(LUXFIELD_SOURCE_DIR) / "../shared/data";
}

}  // namespace luxfield::testdata
