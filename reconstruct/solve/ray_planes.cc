#include "luxfield/reconstruct/solve/ray_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/ray_fit.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LuminaireGeometry;
using lightfield::Vec2;

constexpr int kMargin = 1;  // inner cells left dark on each side, for the fit to ring in
constexpr double kLeastExtent_m = 0.5e-3;  // of the window on F: a point has some width
constexpr double kPointDelta_m = 0.1;
constexpr double kTexelsAcross = 4;  // texels at least over as much of I as the light's extent on F
constexpr double kTexelSlope = 0.3;  // most of a texel over delta, where rays are many
constexpr double kFewestAcross = 8;  // and where they are few: this over the root of their number
constexpr std::size_t kMostRaysTried = 100000;  // a choice of lattice looks at so many

// What the choice steps over: cells of the window on F and texels along the longer side, and delta
// in units of the light's extent on F over that of its slopes.
constexpr std::array kCells{1, 2, 3, 4, 6, 8, 11, 16};
constexpr std::array kTexels{1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181};
constexpr std::array kReaches{1.0, 2.0, 4.0, 8.0, 16.0};

// Steps along the three lists.
struct Trial {
  int cells, texels, reach;
  auto operator<=>(const Trial&) const = default;
};
constexpr Trial kStart{4, 6, 1};

class PlaneChoice {
 public:
  PlaneChoice(std::span<const RayLine> lines, const RayPlaneOptions& options, RayPlanes& planes)
      : options_(options), planes_(planes), all_(lines) {
    TakeSample();
    const double z = planes.filter_z_m, outside = (1 - options.coverage) / 8;
    window_ = FluxWindows(lines, z, outside);
    const double extent = std::max(window_.x.size(), window_.y.size());
    const RayWindows most = FluxWindows(tried(), z, 0.01 / 4);
    planes.relative_window =
        std::max(extent, kLeastExtent_m) / std::max({most.x.size(), most.y.size(), kLeastExtent_m});
    for (RayWindow* window : {&window_.x, &window_.y}) Widen(*window, kLeastExtent_m / 2);
    is_point_ = extent < 0.1 * kLeastExtent_m;
    extent_m_ = std::max(window_.x.size(), window_.y.size());
    const RayWindows directions = SlopeWindows(lines, outside);
    slope_extent_ = std::max({directions.x.size(), directions.y.size(), 1e-3});
  }

  LuminaireGeometry Best() {
    Trial best = kStart;
    if (is_point_) best.cells = 0;
    bool improved = true;
    while (improved) {
      improved = false;
      if (options_.lattice_width == 0) improved |= Descend(best, &Trial::texels, kTexels.size());
      if (options_.grid_width == 0 && !is_point_)
        improved |= Descend(best, &Trial::cells, kCells.size());
      if (!options_.delta_m && options_.lattice_width == 0 && !is_point_)
        improved |= Descend(best, &Trial::reach, kReaches.size());
    }
    return GeometryOf(best, all_);
  }

 private:
  static void Widen(RayWindow& window, double half) {
    half = std::max(half, window.size() / 2);
    window = {window.middle() - half, window.middle() + half};
  }

  void TakeSample() {
    double flux = 0, squares = 0;
    for (const RayLine& line : all_) {
      flux += line.flux;
      squares += line.flux * line.flux;
    }
    independent_rays_ = flux * flux / squares;
    if (all_.size() <= kMostRaysTried) return;
    share_ = static_cast<double>(kMostRaysTried) / static_cast<double>(all_.size());
    core::Random random(1, 0);
    for (const RayLine& line : all_)
      if (random.Uniform() < share_) {
        sample_.push_back(line);
        sample_.back().flux /= share_;
      }
    const bool dark = std::none_of(sample_.begin(), sample_.end(),
                                   [](const RayLine& line) { return line.flux > 0; });
    if (!dark) return;
    sample_.clear();
    share_ = 1;
  }

  std::span<const RayLine> tried() const { return sample_.empty() ? all_ : sample_; }

  // One coordinate to the smallest risk by steps up or down; whether that changed it.
  bool Descend(Trial& best, int Trial::*coordinate, std::size_t count) {
    bool improved = false;
    for (const int step : {1, -1})
      for (;;) {
        Trial next = best;
        next.*coordinate += step;
        if (next.*coordinate < 0 || next.*coordinate >= static_cast<int>(count)) break;
        if (!(Risk(next) < Risk(best))) break;
        best = next;
        improved = true;
      }
    return improved;
  }

  double Risk(const Trial& trial) {
    const auto known = risks_.find(trial);
    if (known != risks_.end()) return known->second;
    const LuminaireGeometry geometry = GeometryOf(trial, tried());
    const double cells =
        window_.x.size() * window_.y.size() / (geometry.grid.spacing_m * geometry.grid.spacing_m);
    const double texel = std::max(geometry.lattice.ds_m, geometry.lattice.dt_m);
    const bool few =
        std::max(cells, 1.0) * static_cast<double>(geometry.plane_size()) <= independent_rays_;
    const bool blend = is_point_ || kTexelsAcross * texel <= extent_m_;
    const bool sharp =
        texel <=
        std::max(kTexelSlope, kFewestAcross / std::sqrt(independent_rays_)) * geometry.delta_m;
    double risk = HUGE_VAL;
    if ((few && blend && sharp) || trial == kStart)
      risk = LatticeRisk(BinRays(tried(), geometry, planes_.filter_z_m, 1), geometry,
                         GramSolver(geometry.grid), share_);
    risks_[trial] = risk;
    return risk;
  }

  LuminaireGeometry GeometryOf(const Trial& trial, std::span<const RayLine> lines) const {
    LuminaireGeometry geometry;
    auto& grid = geometry.grid;
    grid.basis = options_.basis;
    geometry.delta_m = options_.delta_m ? *options_.delta_m
                       : is_point_      ? kPointDelta_m
                       : options_.lattice_width != 0
                           ? 2 * extent_m_
                           : kReaches[trial.reach] * extent_m_ / slope_extent_;
    const int around = grid.basis.cells - 1 + 2 * kMargin;  // functions beyond the window's cells
    if (options_.grid_width > 0) {
      grid.width = options_.grid_width;
      grid.height = options_.grid_height;
      grid.spacing_m = std::max(window_.x.size() / (grid.width - around),
                                window_.y.size() / (grid.height - around));
    } else {
      grid.spacing_m = extent_m_ / kCells[trial.cells];
      const auto cells = [&](const RayWindow& window) {
        return std::max(1, static_cast<int>(std::ceil(window.size() / grid.spacing_m - 1e-9)));
      };
      grid.width = cells(window_.x) + around;
      grid.height = cells(window_.y) + around;
    }
    grid.u0_m = window_.x.middle() - (grid.width + grid.basis.cells - 1) * grid.spacing_m / 2;
    grid.v0_m = window_.y.middle() - (grid.height + grid.basis.cells - 1) * grid.spacing_m / 2;

    RayWindows image =
        FluxWindows(lines, planes_.filter_z_m + geometry.delta_m, (1 - options_.coverage) / 8);
    for (RayWindow* window : {&image.x, &image.y})  // the outermost rays lie inside
      Widen(*window, std::max(window->size() * (0.5 + 1e-6), 0.01 * geometry.delta_m));
    const double texel = std::max(image.x.size(), image.y.size()) / kTexels[trial.texels];
    const auto texels = [&](const RayWindow& window) {
      return std::max(1, static_cast<int>(std::ceil(window.size() / texel - 1e-9)));
    };
    const int width = options_.lattice_width > 0 ? options_.lattice_width : texels(image.x);
    const int height = options_.lattice_width > 0 ? options_.lattice_height : texels(image.y);
    geometry.lattice = {
        width, height, image.x.low, image.y.high, image.x.size() / width, image.y.size() / height};
    return geometry;
  }

  const RayPlaneOptions& options_;
  const RayPlanes& planes_;
  std::span<const RayLine> all_;
  std::vector<RayLine> sample_;
  double share_ = 1, independent_rays_ = 0;
  RayWindows window_;  // on F
  double extent_m_ = 0, slope_extent_ = 0;
  bool is_point_ = false;
  std::map<Trial, double> risks_;
};

}  // namespace

void CheckInnerCells(const lightfield::BasisGrid& grid, int margin) {
  const int least = grid.basis.cells + 2 * margin;
  if (grid.width < least || grid.height < least)
    throw InputError(fmt::format(
        "a grid of {} x {} `{}` functions has too few inner cells; use at least {} each way",
        grid.width, grid.height, grid.basis.name(), least));
}

RayPlanes ChooseRayPlanes(std::span<const RayLine> lines, const RayPlaneOptions& options) {
  if (!(options.coverage > 0 && options.coverage <= 1))
    throw InputError(
        fmt::format("coverage {} must lie above 0 and be at most 1", options.coverage));
  double flux = 0;
  for (const RayLine& line : lines) flux += line.flux;
  if (!(flux > 0))
    throw InputError("no ray with flux travels towards the planes; turn the file with its pose");
  if (options.grid_width > 0) {
    lightfield::BasisGrid grid;
    grid.basis = options.basis;
    grid.width = options.grid_width;
    grid.height = options.grid_height;
    CheckInnerCells(grid, kMargin);
  }
  RayPlanes planes;
  planes.filter_z_m = options.filter_z_m ? *options.filter_z_m : NarrowestZ(lines);
  planes.geometry = PlaneChoice(lines, options, planes).Best();
  return planes;
}

}  // namespace luxfield::reconstruct
