// Small luminaires and files for the tests of lightfield/.
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <string>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

// A folder of this process that goes when it ends.
class ScratchFolder {
 public:
  ScratchFolder()
      : path_(std::filesystem::path(testing::TempDir()) /
              fmt::format("lightfield_{}", ::getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A path that no other test of this or another process uses.
inline std::filesystem::path UniquePath(const std::string& extension) {
  static const ScratchFolder folder;
  static std::atomic<int> counter{0};
  return folder.path() / fmt::format("{}{}", counter++, extension);
}

// An asymmetric geometry in which no two lengths agree, so that a swapped axis shows.
inline LuminaireGeometry SmallGeometry(const Basis& basis, int channels = 1) {
  LuminaireGeometry g;
  g.delta_m = 0.12;
  g.grid = BasisGrid::Centred(basis, 4, 3, 0.021);
  g.grid.u0_m += 0.004;
  g.grid.v0_m -= 0.003;
  g.lattice = {13, 11, -0.11, 0.095, 0.017, 0.016};
  g.channels = channels;
  g.unit = FluxUnit::kLumen;
  return g;
}

// Uniform in [lo, hi).
inline LightField RandomField(const LuminaireGeometry& geometry, std::uint64_t seed, double lo = 0,
                              double hi = 1) {
  LightField field(geometry);
  core::Random random(seed, 0);
  for (float& value : field.data) value = static_cast<float>(lo + (hi - lo) * random.Uniform());
  return field;
}

// Where an integrand on F may have a kink or jump along one axis: the knots, and the texel borders
// brought to F by `to_u`.
inline std::vector<double> BreakpointsU(const LuminaireGeometry& g,
                                        const std::function<double(double)>& to_u) {
  const int cells = g.grid.width + g.grid.basis.cells - 1;
  const double lo = g.grid.u0_m, hi = lo + cells * g.grid.spacing_m;
  std::vector<double> points;
  for (int k = 0; k <= cells; ++k) points.push_back(lo + k * g.grid.spacing_m);
  for (int c = 0; c <= g.lattice.width; ++c)
    points.push_back(std::clamp(to_u(g.lattice.s0_m + c * g.lattice.ds_m), lo, hi));
  std::sort(points.begin(), points.end());
  return points;
}
inline std::vector<double> BreakpointsV(const LuminaireGeometry& g,
                                        const std::function<double(double)>& to_v) {
  const int cells = g.grid.height + g.grid.basis.cells - 1;
  const double lo = g.grid.v0_m, hi = lo + cells * g.grid.spacing_m;
  std::vector<double> points;
  for (int k = 0; k <= cells; ++k) points.push_back(lo + k * g.grid.spacing_m);
  for (int r = 0; r <= g.lattice.height; ++r)
    points.push_back(std::clamp(to_v(g.lattice.t1_m - r * g.lattice.dt_m), lo, hi));
  std::sort(points.begin(), points.end());
  return points;
}

struct Node {
  double x, weight;
};

// Five-point Gauss-Legendre (Abramowitz & Stegun 25.4.30) on every piece: exact up to degree 9.
inline std::vector<Node> GaussNodes(const std::vector<double>& breakpoints) {
  constexpr double kX[] = {-0.906179845938664, -0.538469310105683, 0, 0.538469310105683,
                           0.906179845938664};
  constexpr double kW[] = {0.236926885056189, 0.478628670499366, 0.568888888888889,
                           0.478628670499366, 0.236926885056189};
  std::vector<Node> nodes;
  for (std::size_t k = 0; k + 1 < breakpoints.size(); ++k) {
    const double middle = 0.5 * (breakpoints[k] + breakpoints[k + 1]);
    const double half = 0.5 * (breakpoints[k + 1] - breakpoints[k]);
    if (half <= 0) continue;
    for (int q = 0; q < 5; ++q) nodes.push_back({middle + half * kX[q], half * kW[q]});
  }
  return nodes;
}

}  // namespace luxfield::lightfield
