#include "luxfield/bench/bench_keep.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/bench/undone_damage.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/reference_lamps.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::bench {
namespace {

using lightfield::LightField;
using preprocess::Receiver;
using reconstruct::Keep;

constexpr double kRadius_m = 0.08, kDelta_m = 0.6;
constexpr double kMargin = 1.2;  // interior half-width over the lamp's radius

lightfield::LuminaireGeometry Geometry(const std::string& basis, int cells, int texels) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = kDelta_m;
  const lightfield::Basis functions = lightfield::Basis::FromName(basis);
  const int count = cells + functions.cells - 1;
  geometry.grid =
      lightfield::BasisGrid::Centred(functions, count, count, 2 * kMargin * kRadius_m / cells);
  const double half = 3 * kMargin * kRadius_m, side = 2 * half / texels;
  geometry.lattice = {texels, texels, -half, half, side, side};
  return geometry;
}

// What all solutions of one lamp are held against.
struct Truth {
  std::vector<Receiver> receivers;
  std::vector<double> irradiance;
  double flux = 0;

  Truth(const planning::ReferenceLamp& lamp, const lightfield::LuminaireGeometry& geometry,
        const BenchKeepOptions& options)
      : receivers(planning::ReferenceReceivers(geometry, options.receivers, options.seed)) {
    for (const Receiver& receiver : receivers)
      irradiance.push_back(planning::Irradiance(lamp, receiver));
    const auto& lattice = geometry.lattice;
    for (int row = 0; row < lattice.height; ++row)
      for (int column = 0; column < lattice.width; ++column)
        flux += planning::FluxDensityOnI(lamp, geometry.delta_m, lattice.centre(row, column)) *
                lattice.texel_area_m2();
  }
};

// Squares of the errors of z^2 E_n at the receivers.
std::vector<double> SquaresOfErrors(const LightField& field, const Truth& truth) {
  std::vector<double> error2(truth.receivers.size());
  core::ParallelFor(error2.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto& [p, n] = truth.receivers[k];
      const double e = Dot(n, ClosedFormLightVector(field, p).j[0]);
      error2[k] = std::pow((e - truth.irradiance[k]) * p.z * p.z, 2);
    }
  });
  return error2;
}

nlohmann::json Judge(const LightField& field, const Truth& truth,
                     const std::vector<double>& error2) {
  double errors = 0, squares = 0, negative = 0, positive = 0;
  for (std::size_t k = 0; k < error2.size(); ++k) {
    const double z = truth.receivers[k].p.z;
    errors += error2[k];
    squares += std::pow(truth.irradiance[k] * z * z, 2);
  }
  for (const float c : field.data) (c < 0 ? negative : positive) += std::abs(c);
  return {{"flux_error", TotalFlux(field)[0] / truth.flux - 1},
          {"irradiance_error", std::sqrt(errors / squares)},
          {"negative", positive > 0 ? negative / positive : 0}};
}

void AddRows(const planning::ReferenceLamp& lamp, const std::string& basis, int cells,
             const BenchKeepOptions& options, nlohmann::json* rows) {
  const auto geometry = Geometry(basis, cells, options.texels);
  const Truth truth(lamp, geometry, options);
  const auto measured = planning::MeasureExactly(lamp, geometry);
  for (const Keep keep : {Keep::kNone, Keep::kFlux, Keep::kMoments}) {
    reconstruct::ReconstructOptions how;
    how.precision = reconstruct::Precision::kDouble;
    how.keep = keep;
    std::map<std::string, std::vector<double>> error2;  // of each solve
    const auto add = [&](const std::string& solve, const LightField& field, bool reached) {
      nlohmann::json row{{"basis", basis},      {"cells", cells},
                         {"lamp", lamp.name()}, {"keep", reconstruct::KeepName(keep)},
                         {"solve", solve},      {"edge_reached", reached}};
      error2[solve] = SquaresOfErrors(field, truth);
      row.update(Judge(field, truth, error2[solve]));
      rows->push_back(row);
    };
    auto solved = Reconstruct(measured, how);
    const bool reached = solved.report.edges->reached();
    add("signed", solved.coefficients, reached);
    for (float& c : solved.coefficients.data) c = std::max(c, 0.0f);
    add("clamped", solved.coefficients, reached);
    how.non_negative = true;
    add("non_negative", Reconstruct(measured, how).coefficients, reached);
    if (!options.irradiance_metric || keep != Keep::kMoments) continue;
    how.metric = reconstruct::NonNegativeMetric::kIrradiance;
    const auto start = std::chrono::steady_clock::now();
    solved = Reconstruct(measured, how);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    add("non_negative_irradiance", solved.coefficients, reached);
    auto& row = rows->back();
    row["wall_s"] = wall.count();
    row["iterations"] = solved.report.non_negative->iterations;
    row["unconverged"] = solved.report.non_negative->unconverged;
    const UndoneShare undone =
        UndoneDamage({error2["signed"], error2["non_negative"], error2["non_negative_irradiance"]},
                     options.seed);
    if (!std::isnan(undone.share)) row["damage_undone"] = undone.share;
    if (!std::isnan(undone.low)) row["damage_undone_low"] = undone.low;
    if (!std::isnan(undone.high)) row["damage_undone_high"] = undone.high;
  }
}

}  // namespace

nlohmann::json BenchKeep(const BenchKeepOptions& options) {
  std::vector<planning::ReferenceLamp> lamps;
  for (const planning::ReferenceLamp& lamp : planning::ReferenceLamps(kRadius_m, {0.011, -0.007}))
    if (options.lamps.empty() ||
        std::find(options.lamps.begin(), options.lamps.end(), lamp.name()) != options.lamps.end())
      lamps.push_back(lamp);
  for (const std::string& name : options.lamps)
    if (std::none_of(lamps.begin(), lamps.end(), [&](const auto& l) { return l.name() == name; }))
      throw InputError(fmt::format(
          "--lamps '{}' is not known; give square, disc, filament, ring, gaussian, headlight or "
          "faceted",
          name));
  nlohmann::json rows = nlohmann::json::array();
  core::Progress progress("keep", options.bases.size() * options.cells.size() * lamps.size());
  for (const std::string& basis : options.bases)
    for (const int cells : options.cells)
      for (const planning::ReferenceLamp& lamp : lamps) {
        core::ThrowIfInterrupted();
        AddRows(lamp, basis, cells, options, &rows);
        progress.Advance();
      }
  return rows;
}

}  // namespace luxfield::bench
