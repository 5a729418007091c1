#include "luxfield/bench/truncation_rows.h"

#include <tuple>
#include <vector>

#include "luxfield/bench/mean_squares.h"
#include "luxfield/bench/spot_lamp.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/quadrature.h"
#include "luxfield/reconstruct/budget/basis_truncation.h"
#include "luxfield/reconstruct/budget/coarser_grids.h"

namespace luxfield::bench {
namespace {

using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr double kSpacing_m = 0.03;
constexpr SpotLampOptions kSpots{kSpacing_m / 4, kSpacing_m, kSpacing_m, 0.15};

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

lightfield::LuminaireGeometry Geometry(bool dual) {
  constexpr int kFilters = 7;
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(dual ? BasisKind::kQuadratic : BasisKind::kBspline2), kFilters,
      kFilters, kSpacing_m);
  g.lattice = {2, 2, -0.2, 0.2, 0.2, 0.2};
  g.unit = lightfield::FluxUnit::kLumen;
  return g;
}

LightField Projected(const LightField& lamp, const std::filesystem::path& folder) {
  core::WriteFileAtomically(folder / "random.toml", kLab);
  lightfield::WriteLightField(folder / "random.lf.exr", lamp);
  return hal::sim::SimulatedLab(folder / "random.toml").truth(Geometry(false));
}

// C = <Phi*, lamp> / h^2. The lamp is a polynomial of degree 2 per axis between its knots, which
// lie an even number of steps from the filters' middles: exact.
LightField BehindDualFilters(const LightField& lamp) {
  LightField field(Geometry(true));
  const auto& [grid, lattice] = std::tie(field.geometry.grid, field.geometry.lattice);
  const auto over_axis = [](auto&& f) {
    double sum = 0;
    for (int k = -8; k < 8; ++k) sum += lightfield::Gauss3(0.125 * k, 0.125 * (k + 1), f);
    return sum;
  };
  for (int m = 0; m < grid.count(); ++m)
    for (int texel = 0; texel < lattice.width * lattice.height; ++texel) {
      const Vec2 centre = grid.centre(m % grid.width, m / grid.width),
                 s = lattice.centre(texel / lattice.width, texel % lattice.width);
      const auto seen_at = [&](double x, double y) {
        return FluxDensity(lamp, centre + kSpacing_m * Vec2{x, y}, s)[0] * grid.basis.DualValue(x) *
               grid.basis.DualValue(y);
      };
      field.image(m, 0)[static_cast<std::size_t>(texel)] = static_cast<float>(
          over_axis([&](double y) { return over_axis([&](double x) { return seen_at(x, y); }); }));
    }
  return field;
}

struct Asked {
  const char* name;
  double (*value)(const LightField&);
  reconstruct::LinearForm form;
};

std::vector<Asked> AskedOfLamps() {
  static constexpr Vec2 kRayFrom{0.004, -0.009}, kRayThrough{0.05, 0.03};
  static constexpr Vec3 kAxis{0, 0, 1.3}, kNear{0.05, 0.03, 0.36}, kTowards{0, 0, -1};
  const auto irradiance = [](Vec3 p) -> reconstruct::LinearForm {
    return {[p](const auto& geometry) { return IrradianceWeights(geometry, p, kTowards); }, {}};
  };
  return {
      {"ray",
       [](const LightField& f) { return Radiance(f, kRayFrom, kRayThrough)[0]; },
       {[](const auto& geometry) { return RadianceWeights(geometry, kRayFrom, kRayThrough); },
        kRayThrough}},
      {"flux", [](const LightField& f) { return TotalFlux(f)[0]; }, {lightfield::FluxWeights, {}}},
      {"axis, 1 m", [](const LightField& f) { return ExactIrradiance(f, kAxis, kTowards)[0]; },
       irradiance(kAxis)},
      {"near, aside", [](const LightField& f) { return ExactIrradiance(f, kNear, kTowards)[0]; },
       irradiance(kNear)}};
}

std::vector<double> StatedSigmas(const LightField& seen, lightfield::FilterKind filter,
                                 const std::vector<Asked>& asked) {
  const reconstruct::BasisTruncation truncation(seen, filter, {kSpots.smallest_m});
  std::vector<double> sigmas;
  for (const Asked& what : asked) sigmas.push_back(truncation.Sigma({{1, what.form}}));
  return sigmas;
}

std::vector<double> EstimatedSigmas(const LightField& seen, lightfield::FilterKind filter,
                                    const std::vector<Asked>& asked) {
  std::vector<std::vector<reconstruct::Term>> terms;
  std::vector<const std::vector<reconstruct::Term>*> quantities;
  for (const Asked& what : asked) terms.push_back({{1, what.form}});
  for (const auto& of_quantity : terms) quantities.push_back(&of_quantity);
  std::vector<double> sigmas;
  for (const auto& sigma : reconstruct::CoarserGridSigmas(seen, filter, quantities))
    sigmas.push_back(sigma.value());
  return sigmas;
}

}  // namespace

nlohmann::json TruncationRows(const std::filesystem::path& folder, int lamps, std::uint64_t seed,
                              bool dual, bool estimated) {
  std::filesystem::create_directories(folder);
  const std::vector<Asked> asked = AskedOfLamps();
  MeanSquares squares(estimated ? kEstimatedBasisSource : kBasisSource);
  core::Progress progress("lamps", static_cast<std::uint64_t>(lamps));
  for (int n = 0; n < lamps; ++n) {
    core::ThrowIfInterrupted();
    const LightField lamp = SpotLamp(Geometry(dual), kSpots, seed, n);
    const LightField seen = dual ? BehindDualFilters(lamp) : Projected(lamp, folder);
    const auto filter = dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis;
    const std::vector<double> sigmas =
        estimated ? EstimatedSigmas(seen, filter, asked) : StatedSigmas(seen, filter, asked);
    for (std::size_t q = 0; q < asked.size(); ++q) {
      const double truth = asked[q].value(lamp);
      squares.Add(asked[q].name, truth, sigmas[q], asked[q].value(seen) - truth);
    }
    progress.Advance();
  }
  return squares.Rows();
}

}  // namespace luxfield::bench
