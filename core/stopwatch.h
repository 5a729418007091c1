// Wall and CPU time since construction.
#pragma once

namespace luxfield::core {

class Stopwatch {
 public:
  Stopwatch();
  double WallSeconds() const;
  double CoreSeconds() const;  // CPU time of all threads of the process

 private:
  double wall_s_, core_s_;
};

}  // namespace luxfield::core
