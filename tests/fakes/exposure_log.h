// What a fake camera saw in each of its exposures, as the bench really was: what the frames of a
// session are held against. A text file beside the bench's state, a line each, appended with one
// call, so that a camera that is killed leaves no half line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::fakes {

struct SeenExposure {
  double exposure_s = 0;
  double start_s = 0;       // on the clock of the session
  double u_m = 0, v_m = 0;  // where the filter's centre stood
  double lamp = 0;          // its output, as a monitor reads it; 0: off
  bool shutter_open = false;
  int print = 0;
  std::string pixels_sha256;  // of the DN, as they are in memory
};

// A state file's log.
std::filesystem::path ExposureLogOf(const std::filesystem::path& state);
// Throw std::system_error, std::runtime_error.
void AppendExposure(const std::filesystem::path& log, const SeenExposure& seen);
std::vector<SeenExposure> ReadExposures(const std::filesystem::path& log);

}  // namespace luxfield::fakes
