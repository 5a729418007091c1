#include "study/truncation_rows.h"

#include <cmath>
#include <vector>

#include "core/file.h"
#include "core/json.h"
#include "core/progress.h"
#include "core/random.h"
#include "hal/sim/simulated_lab.h"
#include "lightfield/light_vector.h"
#include "lightfield/quadrature.h"
#include "reconstruct/basis_truncation.h"

namespace luxfield::study {
namespace {

using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec2;

constexpr double kDelta_m = 0.3, kSpacing_m = 0.03;
constexpr int kFilters = 7, kFiner = 4;

constexpr const char* kLab = R"([lab]
driver = "sim"
ideal = true
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
kind = "basis"
basis = "bspline2"
spacing_m = 0.03
[lamp]
kind = "lightfield"
file = "random.lf.exr"
[camera]
width = 8
height = 8
pitch_m = 0.1
saturation_dn = 1000
responsivity_e_per_s_per_w_m2 = [1]
min_exposure_s = 1e-3
max_exposure_s = 1
[stage]
min_m = [-0.2, -0.2]
max_m = [0.2, 0.2]
[sampling]
u_per_cell = 12
)";

lightfield::LuminaireGeometry Geometry(BasisKind basis, int filters, double spacing_m) {
  lightfield::LuminaireGeometry g;
  g.delta_m = kDelta_m;
  g.grid =
      lightfield::BasisGrid::Centred(lightfield::Basis::Make(basis), filters, filters, spacing_m);
  g.lattice = {2, 2, -0.2, 0.2, 0.2, 0.2};
  g.unit = lightfield::FluxUnit::kLumen;
  return g;
}

LightField RandomLamp(std::uint64_t seed, int number) {
  // Spots fade out inside the inner cells of the filters; knots lie on theirs.
  LightField lamp(Geometry(BasisKind::kBspline2, kFilters * kFiner, kSpacing_m / kFiner));
  core::Random random(seed, 0x6C616D70, static_cast<std::uint32_t>(number));
  const int spots = 4 + static_cast<int>(random.Uniform() * 5);
  for (int k = 0; k < spots; ++k) {
    const double inner = kSpacing_m;
    const Vec2 centre{inner * (2 * random.Uniform() - 1), inner * (2 * random.Uniform() - 1)};
    const double width = kSpacing_m * 0.25 * std::pow(4, random.Uniform()),
                 peak = 1e6 * (0.2 + random.Uniform());
    const auto& grid = lamp.geometry.grid;
    for (int j = 0; j < grid.height; ++j)
      for (int i = 0; i < grid.width; ++i) {
        const Vec2 off = grid.centre(i, j) - centre;
        const double value =
            peak * std::exp(-0.5 * (off.x * off.x + off.y * off.y) / (width * width));
        for (float& c : lamp.image(grid.index(i, j), 0)) c += static_cast<float>(value);
      }
  }
  return lamp;
}

LightField Projected(const LightField& lamp, const std::filesystem::path& folder) {
  core::WriteFileAtomically(folder / "random.toml", kLab);
  lightfield::WriteLightField(folder / "random.lf.exr", lamp);
  return hal::sim::SimulatedLab(folder / "random.toml")
      .truth(Geometry(BasisKind::kBspline2, kFilters, kSpacing_m));
}

// C = <Phi*, lamp> / h^2. The lamp is even over I, and a polynomial of degree 2 per axis between
// its knots, which lie an even number of steps from the filters' middles: exact.
LightField BehindDualFilters(const LightField& lamp) {
  LightField field(Geometry(BasisKind::kQuadratic, kFilters, kSpacing_m));
  const auto& grid = field.geometry.grid;
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const auto seen_at = [&](double x, double y) {
        const Vec2 u = grid.centre(i, j) + kSpacing_m * Vec2{x, y};
        return FluxDensity(lamp, u, {0, 0})[0] * grid.basis.DualValue(x) * grid.basis.DualValue(y);
      };
      const auto over_axis = [](auto&& f) {
        double sum = 0;
        for (int k = -2 * kFiner; k < 2 * kFiner; ++k)
          sum += lightfield::Gauss3(0.5 * k / kFiner, 0.5 * (k + 1) / kFiner, f);
        return sum;
      };
      const double c =
          over_axis([&](double y) { return over_axis([&](double x) { return seen_at(x, y); }); });
      for (float& texel : field.image(grid.index(i, j), 0)) texel = static_cast<float>(c);
    }
  return field;
}

struct Asked {
  const char* name;
  double (*value)(const LightField&);
};

constexpr Vec2 kRayFrom{0.004, -0.009}, kRayThrough{0.05, 0.03};

// The ray first: its bound is one of its own.
constexpr Asked kAsked[] = {
    {"ray", [](const LightField& f) { return Radiance(f, kRayFrom, kRayThrough)[0]; }},
    {"flux", [](const LightField& f) { return TotalFlux(f)[0]; }},
    {"axis, 1 m",
     [](const LightField& f) {
       return ExactIrradiance(f, {0, 0, 1.3}, {0, 0, -1})[0];
     }},
    {"near, aside", [](const LightField& f) {
       return ExactIrradiance(f, {0.05, 0.03, 0.36}, {0, 0, -1})[0];
     }}};

}  // namespace

nlohmann::json TruncationRows(const std::filesystem::path& folder, int lamps, std::uint64_t seed,
                              bool dual) {
  std::filesystem::create_directories(folder);
  struct Sums {
    double truth = 0, bound = 0, off = 0;
    int within = 0;
  };
  std::vector<Sums> sums(std::size(kAsked));
  core::Progress progress("lamps", static_cast<std::uint64_t>(lamps));
  for (int n = 0; n < lamps; ++n) {
    core::ThrowIfInterrupted();
    const LightField lamp = RandomLamp(seed, n);
    const LightField seen = dual ? BehindDualFilters(lamp) : Projected(lamp, folder);
    const reconstruct::BasisTruncation truncation(
        seen, dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis);
    for (std::size_t q = 0; q < sums.size(); ++q) {
      const double truth = kAsked[q].value(lamp), value = kAsked[q].value(seen);
      const auto stated =
          q == 0 ? truncation.BoundOfRay(kRayFrom, kRayThrough) : truncation.Bound(kAsked[q].value);
      const double bound = std::pow(stated.value(), 2);
      const double off = (value - truth) * (value - truth);
      sums[q].truth += truth * truth / lamps;
      sums[q].bound += bound / lamps;
      sums[q].off += off / lamps;
      sums[q].within += off <= bound;
    }
    progress.Advance();
  }
  core::Json rows = core::Json::array();
  for (std::size_t q = 0; q < sums.size(); ++q)
    rows.push_back({{"source", kBasisSource},
                    {"quantity", kAsked[q].name},
                    {"runs", lamps},
                    {"value", std::sqrt(sums[q].truth)},
                    {"predicted", std::sqrt(sums[q].bound)},
                    {"observed", std::sqrt(sums[q].off)},
                    {"ratio", std::sqrt(sums[q].bound / sums[q].off)},
                    {"within", static_cast<double>(sums[q].within) / lamps},
                    {"share", std::sqrt(sums[q].off / sums[q].truth)}});
  return rows;
}

}  // namespace luxfield::study
