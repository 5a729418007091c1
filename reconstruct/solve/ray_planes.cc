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

// Of the flux, beside a window on each of its sides.
double OutsideOf(const RayPlaneOptions& options) { return (1 - options.coverage) / 8; }

// The lines that a choice looks at, each with its flux over the share that they are.
struct Sample {
  std::vector<RayLine> lines;
  double share = 1;
};

void Widen(RayWindow& window, double half) {
  half = std::max(half, window.size() / 2);
  window = {window.middle() - half, window.middle() + half};
}

class LatticeSearch {
 public:
  LatticeSearch(const RayPlaneOptions& options, const Sample& sample, double filter_z_m,
                RayWindows on_filter, double slope_extent, double independent_rays)
      : options_(options),
        sample_(sample),
        filter_z_m_(filter_z_m),
        independent_rays_(independent_rays),
        window_(on_filter),
        slope_extent_(std::max(slope_extent, 1e-3)) {
    is_point_ = std::max(window_.x.size(), window_.y.size()) < 0.1 * kLeastExtent_m;
    for (RayWindow* window : {&window_.x, &window_.y}) Widen(*window, kLeastExtent_m / 2);
    extent_m_ = std::max(window_.x.size(), window_.y.size());
    best_ = kStart;
    if (is_point_) best_.cells = 0;
    bool improved = true;
    while (improved) {
      improved = false;
      if (options_.lattice_width == 0) improved |= Descend(&Trial::texels, kTexels.size());
      if (options_.grid_width == 0 && !is_point_) improved |= Descend(&Trial::cells, kCells.size());
      if (!options_.delta_m && options_.lattice_width == 0 && !is_point_)
        improved |= Descend(&Trial::reach, kReaches.size());
    }
  }

  double delta_m() const { return DeltaOf(best_); }

  // Given the window on I, at delta.
  LuminaireGeometry Best(const RayWindows& on_image) const { return GeometryOf(best_, on_image); }

 private:
  // One coordinate to the smallest risk by steps up or down; whether that changed it.
  bool Descend(int Trial::*coordinate, std::size_t count) {
    bool improved = false;
    for (const int step : {1, -1})
      for (;;) {
        Trial next = best_;
        next.*coordinate += step;
        if (next.*coordinate < 0 || next.*coordinate >= static_cast<int>(count)) break;
        if (!(Risk(next) < Risk(best_))) break;
        best_ = next;
        improved = true;
      }
    return improved;
  }

  double Risk(const Trial& trial) {
    const auto known = risks_.find(trial);
    if (known != risks_.end()) return known->second;
    const LuminaireGeometry geometry = GeometryOf(
        trial, WindowsOf(sample_.lines, filter_z_m_ + DeltaOf(trial), OutsideOf(options_)));
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
      risk = LatticeRisk(BinRays(sample_.lines, geometry, filter_z_m_, 1), geometry,
                         GramSolver(geometry.grid), sample_.share);
    risks_[trial] = risk;
    return risk;
  }

  double DeltaOf(const Trial& trial) const {
    if (options_.delta_m) return *options_.delta_m;
    if (is_point_) return kPointDelta_m;
    return options_.lattice_width != 0 ? 2 * extent_m_
                                       : kReaches[trial.reach] * extent_m_ / slope_extent_;
  }

  LuminaireGeometry GeometryOf(const Trial& trial, RayWindows image) const {
    LuminaireGeometry geometry;
    auto& grid = geometry.grid;
    grid.basis = options_.basis;
    geometry.delta_m = DeltaOf(trial);
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
  const Sample& sample_;
  double filter_z_m_, independent_rays_;
  RayWindows window_;  // on F
  double slope_extent_, extent_m_ = 0;
  bool is_point_ = false;
  std::map<Trial, double> risks_;
  Trial best_{};
};

}  // namespace

void CheckInnerCells(const lightfield::BasisGrid& grid, int margin) {
  const int least = grid.basis.cells + 2 * margin;
  if (grid.width < least || grid.height < least)
    throw InputError(fmt::format(
        "a grid of {} x {} `{}` functions has too few inner cells; use at least {} each way",
        grid.width, grid.height, grid.basis.name(), least));
}

class RayPlaneChoice::Passes {
 public:
  explicit Passes(const RayPlaneOptions& options)
      : options_(options),
        on_filter_(OutsideOf(options)),
        slopes_(OutsideOf(options)),
        on_image_(OutsideOf(options)) {}

  void Add(const RayLine& line) {
    if (!(line.flux > 0)) return;
    switch (pass_) {
      case Pass::kFlux:
        ++count_;
        flux_ += line.flux;
        squares_ += line.flux * line.flux;
        waist_.Add(line);
        break;
      case Pass::kSample:
        AddToSample(line);
        [[fallthrough]];
      case Pass::kWindows:
        on_filter_.Add(line.At(planes_.filter_z_m), line.flux);
        slopes_.Add(line.slope, line.flux);
        break;
      case Pass::kImage:
        on_image_.Add(line.At(planes_.filter_z_m + search_->delta_m()), line.flux);
        break;
    }
  }

  bool EndPass() {
    switch (pass_) {
      case Pass::kFlux:
        EndFlux();
        return true;
      case Pass::kSample:
      case Pass::kWindows: {
        const bool more_filter = on_filter_.EndPass(), more_slopes = slopes_.EndPass();
        pass_ = more_filter || more_slopes ? Pass::kWindows : Pass::kImage;
        if (pass_ == Pass::kImage) Search();
        return true;
      }
      case Pass::kImage:
        if (on_image_.EndPass()) return true;
        planes_.geometry = search_->Best(on_image_.windows());
        return false;
    }
    return false;
  }

  const RayPlanes& planes() const { return planes_; }

 private:
  enum class Pass { kFlux, kSample, kWindows, kImage };

  void EndFlux() {
    if (count_ == 0)
      throw InputError("no ray with flux travels towards the planes; turn the file with its pose");
    planes_.filter_z_m = options_.filter_z_m.value_or(waist_.z());
    if (count_ > kMostRaysTried)
      sample_.share = static_cast<double>(kMostRaysTried) / static_cast<double>(count_);
    pass_ = Pass::kSample;
  }

  void AddToSample(const RayLine& line) {
    if (sample_.share < 1 && !(random_.Uniform() < sample_.share)) return;
    sample_.lines.push_back(line);
    sample_.lines.back().flux /= sample_.share;
  }

  void Search() {
    const RayWindows window = on_filter_.windows(), slopes = slopes_.windows();
    const RayWindows most = WindowsOf(sample_.lines, planes_.filter_z_m, 0.01 / 4);
    planes_.relative_window = std::max({window.x.size(), window.y.size(), kLeastExtent_m}) /
                              std::max({most.x.size(), most.y.size(), kLeastExtent_m});
    search_.emplace(options_, sample_, planes_.filter_z_m, window,
                    std::max(slopes.x.size(), slopes.y.size()), flux_ * flux_ / squares_);
    sample_ = {};
  }

  RayPlaneOptions options_;
  Pass pass_ = Pass::kFlux;
  std::uint64_t count_ = 0;  // of lines with flux
  double flux_ = 0, squares_ = 0;
  NarrowestZ waist_;
  core::Random random_{1, 0};
  Sample sample_;
  FluxWindows on_filter_, slopes_, on_image_;
  std::optional<LatticeSearch> search_;
  RayPlanes planes_;
};

RayPlaneChoice::RayPlaneChoice(const RayPlaneOptions& options) {
  if (!(options.coverage > 0 && options.coverage <= 1))
    throw InputError(
        fmt::format("coverage {} must lie above 0 and be at most 1", options.coverage));
  if (options.grid_width > 0) {
    lightfield::BasisGrid grid;
    grid.basis = options.basis;
    grid.width = options.grid_width;
    grid.height = options.grid_height;
    CheckInnerCells(grid, kMargin);
  }
  passes_ = std::make_unique<Passes>(options);
}

RayPlaneChoice::~RayPlaneChoice() = default;
RayPlaneChoice::RayPlaneChoice(RayPlaneChoice&&) noexcept = default;

void RayPlaneChoice::Add(const RayLine& line) { passes_->Add(line); }
bool RayPlaneChoice::EndPass() { return passes_->EndPass(); }
const RayPlanes& RayPlaneChoice::planes() const { return passes_->planes(); }

}  // namespace luxfield::reconstruct
