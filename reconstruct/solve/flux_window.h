// Intervals that hold all but a share of the flux, of rays that are gone through in passes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::reconstruct {

struct RayWindow {
  double low = 0, high = 0;
  double size() const { return high - low; }
  double middle() const { return (low + high) / 2; }
  bool Holds(double x) const { return x >= low && x <= high; }
};

// The least x such that values up to it have `target` of the flux, or more; the largest where that
// is never so. Each pass puts the values between two that are known to enclose it into cells, whose
// flux says in which it lies; where few are left they are kept and sorted. Exact but for the
// rounding of the sums of flux; memory does not grow with the number of values.
class FluxQuantile {
 public:
  // `count` values, from `low` to `high`.
  void Start(double target, double low, double high, std::uint64_t count);
  void Add(double x, double flux);
  bool EndPass();  // whether another is needed
  double value() const { return low_; }

 private:
  struct Cell {
    double flux = 0, low = 0, high = 0;
    std::uint64_t count = 0;
  };

  bool Enclose(double low, double high, std::uint64_t count);
  void TakeFromKept();

  double target_ = 0, below_ = 0;  // flux; below_: of the values less than low_
  double low_ = 0, high_ = 0;      // both are values
  bool done_ = true;
  std::vector<Cell> cells_;
  std::vector<std::pair<double, double>> kept_;  // values and their flux
};

// Between the flux quantiles `outside` and 1 - `outside`; all values with flux for 0, found in one
// pass. Used so:
//
//   do
//     for (...) window.Add(x, flux);
//   while (window.EndPass());
class FluxWindow {
 public:
  explicit FluxWindow(double outside) : outside_(outside) {}
  void Add(double x, double flux);
  bool EndPass();
  const RayWindow& window() const { return window_; }

 private:
  double outside_, flux_ = 0;
  std::uint64_t count_ = 0;
  bool first_ = true;
  RayWindow window_;
  std::array<FluxQuantile, 2> ends_;
};

struct RayWindows {
  RayWindow x, y;
};

// The same along x and y of points.
class FluxWindows {
 public:
  explicit FluxWindows(double outside) : x_(outside), y_(outside) {}
  void Add(lightfield::Vec2 at, double flux) {
    x_.Add(at.x, flux);
    y_.Add(at.y, flux);
  }
  bool EndPass() {
    const bool more_x = x_.EndPass(), more_y = y_.EndPass();
    return more_x || more_y;
  }
  RayWindows windows() const { return {x_.window(), y_.window()}; }

 private:
  FluxWindow x_, y_;
};

}  // namespace luxfield::reconstruct
