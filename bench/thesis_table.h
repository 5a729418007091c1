// The thesis' own figures (H. Lu 2014; docs/theory.md 11) beside ours for the same work.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace luxfield::bench {

struct ThesisTableOptions {
  std::filesystem::path scenes = "data/scenes", lamps = "out/lamps";
  int width = 1024, height = 768;            // of the pictures that are timed, as the thesis'
  int small_width = 128, small_height = 96;  // of those whose error is asked
  std::string device;                        // as --device
  int threads = 0;                           // of an OpenCL CPU device, 0: all
};

// Rows {"what", "unit", "thesis", "ours", "how"}; `how` says what was run. A figure that the thesis
// gives in words, or that is a share of another, stands in `thesis` as text. Rows whose estimators
// this program does not have are not there. Takes a minute or two; throws InputError (no lamps:
// make them first), DeviceError, Interrupted.
nlohmann::json ThesisTable(const ThesisTableOptions& options = {});

}  // namespace luxfield::bench
