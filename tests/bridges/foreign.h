// Programs of others that judge what is exported: those that `./run foreign` installed, else those of
// the PATH. Tests skip loudly without them.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "luxfield/core/file.h"
#include "tests/formats/light_field_lamps.h"

namespace luxfield::bridges {

inline std::string OutputOf(const std::string& command) {
  std::string out;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  char piece[4096];
  while (const std::size_t read = pipe ? std::fread(piece, 1, sizeof(piece), pipe) : 0)
    out.append(piece, read);
  if (pipe) ::pclose(pipe);
  return out;
}

inline std::string ForeignFolder() { return LUXFIELD_SOURCE_DIR "/build/foreign/bin"; }

// Its path; empty where it is not there.
inline std::string ForeignProgram(const std::string& name) {
  const auto installed = std::filesystem::path(ForeignFolder()) / name;
  if (std::filesystem::exists(installed)) return installed.string();
  std::string found = OutputOf("command -v " + name);
  while (!found.empty() && found.back() == '\n') found.pop_back();
  // Judges compute with numpy, which a Python of the system may lack.
  const bool lacks =
      name == "python" && OutputOf("python -c 'import numpy; print(1)' 2>/dev/null").empty();
  return lacks ? std::string() : found;
}

// A folder of the test's own, removed at its end.
class Scratch {
 public:
  explicit Scratch(const std::string& name)
      : folder_(std::filesystem::path(testing::TempDir()) /
                ("bridges_" + std::to_string(::getpid()) + "_" + name)) {
    std::filesystem::create_directories(folder_);
  }
  ~Scratch() { std::filesystem::remove_all(folder_); }
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

#define LUXFIELD_NEEDS_FOREIGN(program)                                                      \
  do {                                                                                       \
    if (!ForeignProgram(program).empty()) break;                                             \
    std::printf(                                                                             \
        "SKIPPED: %s is neither in build/foreign (./run foreign) nor in PATH: it judges no " \
        "export\n",                                                                          \
        program);                                                                            \
    GTEST_SKIP() << program << " is not installed";                                          \
  } while (false)

// Two fields, neither of whose faces stands before the other.
inline std::vector<lightfield::PosedLightField> LampOfTwoFaces() {
  auto lamp = formats::LampOfTwoSides();
  lamp[1].luminaire_from_field.translation_m = {0.04, 0.01, -0.06};
  return lamp;
}

}  // namespace luxfield::bridges
