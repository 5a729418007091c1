// Programs as users start them, timed.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace luxfield::bench {

struct ProcessRun {
  double wall_s = 0, core_s = 0;  // core_s: of the process and those that it waited for
  double peak_mib = 0;            // largest resident set of one process among them
};

// Environment variables that are set anew for the process.
using Variables = std::vector<std::pair<std::string, std::string>>;

// Runs `words` (the program's path first) with its output in `folder`/output.txt. Throws DeviceError
// with the last line of that where it does not end with 0, or cannot be started.
ProcessRun RunProcess(const std::vector<std::string>& words, const std::filesystem::path& folder,
                      const Variables& variables = {});

// The program `luxfield` that this one belongs to: beside it or, installed, in ../../bin. Throws
// DeviceError where there is none.
std::filesystem::path LuxfieldProgram();

}  // namespace luxfield::bench
