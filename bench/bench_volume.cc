#include "luxfield/bench/bench_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/reference_lamps.h"
#include "luxfield/render/estimators/volume.h"

namespace luxfield::bench {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Receiver;

struct Grid {
  const char* name;
  int width, height;  // images
  int columns, rows;  // texels
  double delta_m, spacing_m;
};
// Images of 0.9 m x 0.7 m.
constexpr Grid kGrids[] = {{"4x4 of 1x1", 4, 4, 1, 1, 0.3, 0.05},
                           {"5x4 of 24x18", 5, 4, 24, 18, 0.25, 0.031},
                           {"9x7 of 96x72", 9, 7, 96, 72, 0.4, 0.0165}};

// Images of a lamp: the flux density that leaves the middle third of a cell for the middle of a
// texel. No projection, but all of its edges.
LightField ImagesOf(const planning::ReferenceLamp& lamp, const LuminaireGeometry& geometry) {
  LightField field(geometry);
  for (int j = 0; j < geometry.grid.height; ++j)
    for (int i = 0; i < geometry.grid.width; ++i) {
      const Vec2 centre = geometry.grid.centre(i, j);
      const double step = geometry.grid.spacing_m / 3;
      float* texel = field.image(geometry.grid.index(i, j), 0).data();
      for (int r = 0; r < geometry.lattice.height; ++r)
        for (int c = 0; c < geometry.lattice.width; ++c) {
          double sum = 0;
          for (int k = 0; k < 9; ++k)
            sum += lamp.FluxDensity(geometry.delta_m,
                                    centre + Vec2{step * (k % 3 - 1), step * (k / 3 - 1)},
                                    geometry.lattice.centre(r, c));
          *texel++ = static_cast<float>(sum / 9);
        }
    }
  return field;
}

LuminaireGeometry GeometryOf(const Grid& grid, lightfield::BasisKind basis) {
  LuminaireGeometry g;
  g.delta_m = grid.delta_m;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(basis), grid.width, grid.height,
                                          grid.spacing_m);
  g.grid.u0_m += 0.013;
  g.grid.v0_m -= 0.008;
  g.lattice = {grid.columns, grid.rows, -0.46, 0.36, 0.9 / grid.columns, 0.7 / grid.rows};
  return g;
}

Vec3 RoundToFloat(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

class Draw {
 public:
  Draw(const LuminaireGeometry& geometry, std::uint64_t seed)
      : geometry_(geometry), random_(seed, 2) {}

  double Between(double lo, double hi) { return lo + (hi - lo) * random_.Uniform(); }
  double LogBetween(double lo, double hi) { return lo * std::pow(hi / lo, random_.Uniform()); }

  // Up to half as far beside the axis as in front, and as far as the supports reach.
  Vec3 Point(double z) {
    return {Between(-0.5, 0.5) * z + Between(-0.05, 0.05),
            Between(-0.5, 0.5) * z + Between(-0.05, 0.05), z};
  }
  // Facing F more or less.
  Receiver Facing(double z) {
    return {Point(z), Normalized(Vec3{Between(-1, 1), Between(-1, 1), -Between(0.1, 1)})};
  }
  // The horizon passes through a point of the supports.
  Receiver Cut(double z) {
    const auto& grid = geometry_.grid;
    const double width = (grid.width + grid.basis.cells - 1) * grid.spacing_m,
                 height = (grid.height + grid.basis.cells - 1) * grid.spacing_m;
    const Vec3 p = Point(z), u{grid.u0_m + Between(0.05, 0.95) * width,
                               grid.v0_m + Between(0.05, 0.95) * height, 0};
    const double angle = Between(0, 2 * std::numbers::pi);
    return {p, Normalized(Cross(p - u, {std::cos(angle), std::sin(angle), Between(-1, 1)}))};
  }

 private:
  const LuminaireGeometry& geometry_;
  core::Random random_;
};

std::vector<Receiver> Receivers(const LuminaireGeometry& geometry, int of_each_kind,
                                std::uint64_t seed) {
  Draw draw(geometry, seed);
  const double delta = geometry.delta_m;
  std::vector<Receiver> receivers;
  for (int k = 0; k < of_each_kind; ++k) {
    receivers.push_back(draw.Facing(delta * draw.LogBetween(1.02, 30)));
    receivers.push_back(draw.Cut(delta * draw.LogBetween(0.02, 30)));
    receivers.push_back(
        draw.Facing(delta * (k % 4 ? draw.LogBetween(0.02, 1) : draw.Between(0.9999, 1.0001))));
    receivers.push_back(draw.Facing(delta * draw.LogBetween(1e-4, 0.02)));
  }
  for (Receiver& receiver : receivers)
    receiver = {RoundToFloat(receiver.p), RoundToFloat(receiver.n)};
  return receivers;
}

// Those that see light, with that in closed form.
std::vector<preprocess::JudgedReceiver> Judged(const LightField& field,
                                               const std::vector<Receiver>& receivers) {
  std::vector<preprocess::JudgedReceiver> all(receivers.size());
  core::ParallelFor(receivers.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      all[k] = {receivers[k],
                !lightfield::HorizonCutsSupport(field.geometry, receivers[k].p, receivers[k].n) &&
                    receivers[k].p.z > field.geometry.delta_m,
                lightfield::ExactIrradiance(field, receivers[k].p, receivers[k].n)};
  });
  std::erase_if(all, [](const auto& one) { return !(one.irradiance[0] > 0); });
  return all;
}

// Of some receivers.
struct Errors {
  double squares = 0, sum = 0;
  int count = 0;

  void Add(double error, double truth) {
    squares += error * error;
    sum += truth;
    ++count;
  }
  double RelativeRmse() const { return sum > 0 ? std::sqrt(squares * count) / sum : 0; }
};

nlohmann::json Row(const render::Device& device, render::Estimator& estimator,
                   const LightField& field, const BenchVolumeOptions& options) {
  const LuminaireGeometry& g = field.geometry;
  const auto made_for = Receivers(g, options.receivers, options.seed);
  const auto built = preprocess::BuildForReceivers(
      field, made_for, {.max_rel_error = options.max_rel_error}, made_for.size(), options.seed);
  const int nodes = built.volume.a_x.nodes * built.volume.a_y.nodes * built.volume.tau.nodes;
  nlohmann::json row{{"nodes", nodes}, {"met", built.met}};
  if (!built.met) return row;
  const render::LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
  const auto receivers = Judged(field, Receivers(g, options.receivers, options.seed + 1));
  const auto lit =
      render::LightReceivers(device, estimator, luminaire, receivers, options.max_rel_error);
  Errors all, cut, between, table;
  double worst = 0;
  int off = 0, lost = 0;
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const auto& [receiver, by_volume, irradiance] = receivers[k];
    const double truth = irradiance[0], error = std::abs(lit[k].s[0] - truth);
    all.Add(error, truth);
    if (by_volume) {
      table.Add(error, truth);
      continue;
    }
    const bool is_cut = lightfield::HorizonCutsSupport(g, receiver.p, receiver.n);
    (is_cut ? cut : between).Add(error, truth);
    const double size = Length(lightfield::ClosedFormLightVector(field, receiver.p).j[0]);
    worst = std::max(worst, error / size);
    if (truth < 0.01 * size) continue;
    off += error > 0.05 * truth;
    lost += lit[k].s[0] == 0;
  }
  const double at_judges = render::RelativeRmse(
      built.judges,
      render::LightReceivers(device, estimator, luminaire, built.judges, options.max_rel_error));
  row.update({{"stated", std::max(built.rel_error, at_judges)},
              {"receivers", all.count},
              {"rel_rmse", all.RelativeRmse()},
              {"table", table.RelativeRmse()},
              {"cuts", cut.count},
              {"cut", cut.RelativeRmse()},
              {"between", between.RelativeRmse()},
              {"worst", worst},
              {"off", off},
              {"lost", lost}});
  return row;
}

}  // namespace

nlohmann::json BenchVolume(const BenchVolumeOptions& options) {
  if (options.receivers < 1) throw InputError("bench volume: at least one receiver of each kind");
  const auto device = render::Device::Open(options.device, options.threads);
  const auto estimator = render::MakeEstimator("volume", device);
  nlohmann::json rows = nlohmann::json::array();
  for (const auto basis : {lightfield::BasisKind::kBox, lightfield::BasisKind::kBilinear,
                           lightfield::BasisKind::kQuadratic, lightfield::BasisKind::kBspline2})
    for (const Grid& grid : kGrids) {
      const LuminaireGeometry geometry = GeometryOf(grid, basis);
      const double radius_m = 0.4 * grid.height * grid.spacing_m;
      for (const planning::ReferenceLamp& lamp :
           planning::ReferenceLamps(radius_m, preprocess::SupportCentre(geometry))) {
        // Thinner than what images of these grids resolve.
        if (lamp.kind == planning::ReferenceLampKind::kFilament) continue;
        const LightField field = ImagesOf(lamp, geometry);
        nlohmann::json row{
            {"basis", geometry.grid.basis.name()}, {"grid", grid.name}, {"lamp", lamp.name()}};
        row.update(Row(device, *estimator, field, options));
        rows.push_back(row);
      }
    }
  return rows;
}

}  // namespace luxfield::bench
