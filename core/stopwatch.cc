#include "luxfield/core/stopwatch.h"

#include <time.h>

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <string>

namespace luxfield::core {
namespace {

double Now(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Stopwatch::Stopwatch() : wall_s_(Now(CLOCK_MONOTONIC)), core_s_(Now(CLOCK_PROCESS_CPUTIME_ID)) {}

double Stopwatch::WallSeconds() const { return Now(CLOCK_MONOTONIC) - wall_s_; }

double Stopwatch::CoreSeconds() const { return Now(CLOCK_PROCESS_CPUTIME_ID) - core_s_; }

double TakePeakMib() {
  double peak_mib = 0;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) peak_mib = std::stod(line.substr(6)) / 1024;
  std::ofstream("/proc/self/clear_refs") << "5";  // resets VmHWM
  return peak_mib;
}

double Median(std::vector<double> seconds) {
  const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return *middle;
}

}  // namespace luxfield::core
