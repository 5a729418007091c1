#include "luxfield/bench/bench_signed.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/reconstruct/solve/non_negative.h"
#include "luxfield/render/accuracy/lamp_tables.h"

namespace luxfield::bench {
namespace {

using lightfield::LightField;
using preprocess::Receiver;

constexpr double kRadius = 0.048, kDelta = 0.3;
// Cells between the lamp's rim and the middle of the outermost basis function: `bspline2` ramps to
// 0 over the outer two.
constexpr double kMargin = 1.6;
constexpr double kRounding = 1e-6;

lightfield::LuminaireGeometry GeometryOf(lightfield::BasisKind kind, int grid, int size) {
  lightfield::LuminaireGeometry g;
  g.delta_m = kDelta;
  g.unit = lightfield::FluxUnit::kLumen;
  const double spacing = kRadius / (0.5 * grid - kMargin);
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), grid, grid, spacing);
  const double side = 2 * 0.35 * kDelta + (grid + 2) * spacing;
  g.lattice = {size, size, -0.5 * side, 0.5 * side, side / size, side / size};
  return g;
}

double NegativeShare(const LightField& field) {
  double positive = 0, negative = 0;
  for (const float c : field.data) (c < 0 ? negative : positive) += std::abs(double{c});
  return positive > 0 ? negative / positive : 0;
}

LightField NonNegative(LightField field) {
  std::vector<float*> images;
  for (int m = 0; m < field.geometry.grid.count(); ++m) images.push_back(field.image(m, 0).data());
  reconstruct::ProjectNonNegative(reconstruct::GramSolver(field.geometry.grid), images.data(),
                                  field.geometry.plane_size());
  return field;
}

render::GBuffer MakeGBuffer(const render::Device& device, const std::vector<Receiver>& receivers) {
  std::vector<cl_float4> position, normal;
  for (const auto& [p, n] : receivers) {
    position.push_back(
        {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 1}});
    normal.push_back(
        {{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z), 0}});
  }
  render::GBuffer gbuffer(device, static_cast<int>(receivers.size()), 1);
  gbuffer.position.Upload(std::span<const cl_float4>(position));
  gbuffer.normal.Upload(std::span<const cl_float4>(normal));
  return gbuffer;
}

// Over the receivers.
using Values = std::vector<double>;

Values InParallel(const std::vector<Receiver>& receivers, const auto& value) {
  Values values(receivers.size());
  core::ParallelFor(receivers.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) values[k] = value(receivers[k]);
  });
  return values;
}

double RmsDifference(const Values& a, const Values& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// A sampler's scatter about the truth over seeds.
struct Scatter {
  double rms = 0;        // of one picture
  double z = 0, t2 = 0;  // of the means
};

class Bench {
 public:
  explicit Bench(const BenchSignedOptions& options)
      : options_(options), device_(render::Device::Open(options.device, options.threads)) {}

  Scatter Sample(const char* name, const LightField& field, const render::GBuffer& gbuffer,
                 const Values& exact) {
    const auto estimator = render::MakeEstimator(name, device_);
    const render::LampTables tables =
        render::BuildLampTables(field, gbuffer, estimator->traits().needs);
    const render::LuminaireOnDevice luminaire(device_, field, tables.view());
    const int seeds = options_.seeds;
    Values sum(exact.size(), 0.0), square(exact.size(), 0.0);
    Scatter scatter;
    for (int seed = 0; seed < seeds; ++seed) {
      render::EstimatorOptions how;
      how.samples_per_pixel = options_.samples_per_pixel;
      how.seed = options_.seed + seed;
      render::Lighting lighting(device_, gbuffer);
      estimator->Light({gbuffer}, render::PosedLuminaire{luminaire}, how, lighting);
      const auto values = lighting.irradiance.Download<cl_float4>();
      for (std::size_t k = 0; k < exact.size(); ++k) {
        const double error = values[k].s[0] - exact[k];
        sum[k] += error;
        square[k] += error * error;
      }
    }
    double errors = 0, variances = 0, mean_light = 0;
    for (const double e : exact) mean_light += std::abs(e) / static_cast<double>(exact.size());
    for (std::size_t k = 0; k < exact.size(); ++k) {
      const double mean = sum[k] / seeds,
                   // Of the mean, and the rounding of float32.
          variance = std::max(square[k] / seeds - mean * mean, 0.0) / (seeds - 1) +
                     std::pow(kRounding * mean_light, 2);
      scatter.rms += square[k] / seeds / static_cast<double>(exact.size());
      scatter.t2 += mean * mean / variance / static_cast<double>(exact.size());
      errors += mean;
      variances += variance;
    }
    scatter.rms = std::sqrt(scatter.rms);
    scatter.z = errors / std::sqrt(variances);
    return scatter;
  }

  nlohmann::json Row(lightfield::BasisKind kind, int grid, planning::ReferenceLampKind lamp_kind) {
    const auto geometry = GeometryOf(kind, grid, options_.size);
    const planning::ReferenceLamp lamp{.kind = lamp_kind, .radius_m = kRadius};
    const auto receivers =
        planning::ReferenceReceivers(geometry, options_.receivers, options_.seed);
    const auto gbuffer = MakeGBuffer(device_, receivers);
    const LightField projected = planning::Project(lamp, geometry), cut = NonNegative(projected);
    const auto closed_form = [&](const LightField& field) {
      return InParallel(receivers, [&](const Receiver& receiver) {
        return lightfield::ExactIrradiance(field, receiver.p, receiver.n)[0];
      });
    };
    const Values truth = InParallel(
        receivers, [&](const Receiver& receiver) { return planning::Irradiance(lamp, receiver); });
    const Values of_projected = closed_form(projected), of_cut = closed_form(cut);
    double mean = 0;
    for (const double e : truth) mean += e / static_cast<double>(truth.size());
    const Scatter cells = Sample("cells", projected, gbuffer, of_projected),
                  windowed = Sample("windowed", projected, gbuffer, of_projected),
                  cells_of_cut = Sample("cells", cut, gbuffer, of_cut);
    return {{"basis", geometry.grid.basis.name()},
            {"grid", grid},
            {"lamp", lamp.name()},
            {"negative_share", NegativeShare(projected)},
            {"signed_error", RmsDifference(of_projected, truth) / mean},
            {"non_negative_error", RmsDifference(of_cut, truth) / mean},
            {"signed_noise", cells.rms / mean},
            {"non_negative_noise", cells_of_cut.rms / mean},
            {"windowed_noise", windowed.rms / mean},
            {"cells_t2", cells.t2},
            {"windowed_t2", windowed.t2},
            {"cells_z", cells.z}};
  }

 private:
  const BenchSignedOptions& options_;
  render::Device device_;
};

}  // namespace

nlohmann::json BenchSigned(const BenchSignedOptions& options) {
  if (std::min({options.size, options.receivers, options.samples_per_pixel}) < 1 ||
      options.seeds < 4 || options.grids.empty() || std::ranges::min(options.grids) < 5)
    throw InputError(
        "bench signed: size, receivers and samples must be at least 1, seeds 4 and grids 5");
  Bench bench(options);
  nlohmann::json rows = nlohmann::json::array();
  for (const auto basis : options.bases)
    for (const int grid : options.grids)
      for (const auto lamp : options.lamps) rows.push_back(bench.Row(basis, grid, lamp));
  return rows;
}

}  // namespace luxfield::bench
