// Where tests keep sessions that need no real disk.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

namespace luxfield {

// In memory where that is possible: the syncs of a real disk are slow, and prove nothing to a test
// that does not pull its plug.
inline std::filesystem::path MemoryFolder() {
  const std::filesystem::path memory = "/dev/shm";
  return std::filesystem::is_directory(memory) ? memory : std::filesystem::path(testing::TempDir());
}

}  // namespace luxfield
