// Folders of sessions for the tests of core.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/session/session_writer.h"
#include "tests/session/small_session.h"

namespace luxfield::session {

inline std::filesystem::path NewFolder(const std::string& name) {
  static int counter = 0;
  const auto path = std::filesystem::path(testing::TempDir()) /
                    fmt::format("session_{}_{}_{}", name, ::getpid(), counter++);
  std::filesystem::remove_all(path);
  return path;
}

inline std::filesystem::path WholeSession(const std::string& name) {
  const auto folder = NewFolder(name);
  core::SimulatedClock clock;
  auto writer = SessionWriter::Create(folder, kPlan, kSession, {}, clock);
  CaptureRest(writer);
  return folder;
}

inline void Overwrite(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline std::string MessageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError";
}

}  // namespace luxfield::session
