// Wall and CPU time since construction.
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

// The middle one of repeated timings, of an even number the longer; there must be one.
double Median(std::vector<double> seconds);

}  // namespace luxfield::core
