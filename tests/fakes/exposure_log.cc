#include "tests/fakes/exposure_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace luxfield::fakes {

std::filesystem::path ExposureLogOf(const std::filesystem::path& state) {
  return std::filesystem::path(state) += ".exposures";
}

void AppendExposure(const std::filesystem::path& log, const SeenExposure& seen) {
  const std::string line =
      fmt::format("{} {} {} {} {} {:d} {} {}\n", seen.exposure_s, seen.start_s, seen.u_m, seen.v_m,
                  seen.lamp, seen.shutter_open, seen.print, seen.pixels_sha256);
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  const bool done =
      file >= 0 && write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const int error = errno;
  if (file >= 0) close(file);
  if (!done) throw std::system_error(error, std::generic_category(), log.string());
}

std::vector<SeenExposure> ReadExposures(const std::filesystem::path& log) {
  std::vector<SeenExposure> exposures;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    SeenExposure seen;
    if (!(words >> seen.exposure_s >> seen.start_s >> seen.u_m >> seen.v_m >> seen.lamp >>
          seen.shutter_open >> seen.print >> seen.pixels_sha256))
      throw std::runtime_error(log.string() + ": no exposure: " + line);
    exposures.push_back(seen);
  }
  return exposures;
}

}  // namespace luxfield::fakes
