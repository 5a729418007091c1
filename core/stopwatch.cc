#include "core/stopwatch.h"

#include <time.h>

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

}  // namespace luxfield::core
