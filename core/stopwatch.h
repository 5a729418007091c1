// Wall and CPU time since construction, and memory.
#pragma once

#include <vector>

namespace luxfield::core {

class Stopwatch {
 public:
  Stopwatch();
  double WallSeconds() const;
  double CoreSeconds() const;  // CPU time of all threads of the process

 private:
  double wall_s_, core_s_;
};

// The process's largest resident set since the last call, MiB; 0 where the system does not say
// (Linux does).
double TakePeakMib();

// The middle one of repeated timings, of an even number the longer; there must be one.
double Median(std::vector<double> seconds);

}  // namespace luxfield::core
