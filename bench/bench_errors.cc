#include "luxfield/bench/bench_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/planning/traced_lamp.h"

namespace luxfield::bench {
namespace {

const std::vector<std::string> kRandomSources = {"photon_noise", "read_noise", "dark_current",
                                                 "prnu"};

// Running mean and variance of every coefficient over the seeds (Welford), and the mean propagated
// variance.
class SeedStatistics {
 public:
  void Add(std::span<const float> coefficients, std::span<const float> sigma) {
    if (mean_.empty()) {
      mean_.assign(coefficients.size(), 0);
      squares_.assign(coefficients.size(), 0);
      variance_.assign(coefficients.size(), 0);
    }
    ++count_;
    for (std::size_t k = 0; k < mean_.size(); ++k) {
      const double before = coefficients[k] - mean_[k];
      mean_[k] += before / count_;
      squares_[k] += before * (coefficients[k] - mean_[k]);
      variance_[k] += double{sigma[k]} * sigma[k];
    }
  }

  // Over all coefficients, then over quarters from dark to bright. Not in the order of sigma: it
  // follows the noise, so that its lowest quarter would hold what happens to spread little.
  std::vector<double> Ratios(std::span<const float> truth) const {
    std::vector<std::size_t> order(mean_.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(), [truth](std::size_t a, std::size_t b) {
      return std::abs(truth[a]) < std::abs(truth[b]);
    });
    const std::size_t n = order.size();
    std::vector<double> ratios{Ratio(order, 0, n)};
    for (std::size_t quarter = 0; quarter < 4; ++quarter)
      ratios.push_back(Ratio(order, n * quarter / 4, n * (quarter + 1) / 4));
    return ratios;
  }

 private:
  double Ratio(const std::vector<std::size_t>& order, std::size_t begin, std::size_t end) const {
    double observed = 0, predicted = 0;
    for (std::size_t k = begin; k < end; ++k) {
      observed += squares_[order[k]] / (count_ - 1);
      predicted += variance_[order[k]] / count_;
    }
    return std::sqrt(observed / predicted);
  }

  int count_ = 0;
  std::vector<double> mean_, squares_, variance_;
};

// Of one case, over its seeds.
class Errors {
 public:
  Errors(const planning::TracedLamp& lamp, const lightfield::LightField& truth)
      : lamp_(lamp),
        truth_(truth),
        lamp_flux_(planning::FluxThrough(truth.geometry.lattice, lamp, kRays).value) {}

  void Add(const lightfield::LightField& measured) {
    const auto compared = planning::CompareWithLamp({&measured, &truth_}, lamp_, kRays);
    const planning::StageError projection = planning::CompareWithTruth(measured.data, truth_.data);
    ++seeds_;
    rmse_ += compared[0].rel_rmse * compared[0].rel_rmse;
    l2_ += compared[0].rel_l2 * compared[0].rel_l2;
    projection_rmse_ += projection.rel_rmse * projection.rel_rmse;
    projection_l2_ += projection.rel_l2 * projection.rel_l2;
    flux_ += planning::LuminousFlux(measured) / lamp_flux_ - 1;
    floor_ = compared[1];
  }

  core::Json Row(const std::string& name) const {
    return {{"case", name},
            {"seeds", seeds_},
            {"rel_rmse", std::sqrt(rmse_ / seeds_)},
            {"rel_l2", std::sqrt(l2_ / seeds_)},
            {"floor_rel_rmse", floor_.rel_rmse},
            {"floor_rel_l2", floor_.rel_l2},
            {"projection_rel_rmse", std::sqrt(projection_rmse_ / seeds_)},
            {"projection_rel_l2", std::sqrt(projection_l2_ / seeds_)},
            {"flux_error", flux_ / seeds_}};
  }

 private:
  static constexpr std::uint64_t kRays = 1;  // the same ones for all

  const planning::TracedLamp& lamp_;
  const lightfield::LightField& truth_;
  double lamp_flux_;
  int seeds_ = 0;
  double rmse_ = 0, l2_ = 0, projection_rmse_ = 0, projection_l2_ = 0, flux_ = 0;
  planning::StageError floor_;
};

}  // namespace

nlohmann::json BenchErrors(const BenchErrorsOptions& options) {
  if (options.seeds < 2)
    throw InputError(
        fmt::format("--seeds = {} must be at least 2; a spread needs two", options.seeds));
  std::filesystem::create_directories(options.folder);
  const auto sources = planning::ErrorSources(options.lab);
  const auto has = [&](const std::string& name) {
    return std::find(sources.begin(), sources.end(), name) != sources.end();
  };

  const capture::Plan plan = capture::ReadPlan(options.plan);
  const auto truth = hal::sim::SimulatedLab(options.lab, options.seed).truth(plan.geometry);
  const planning::TracedLamp lamp(
      hal::sim::ReadLab(core::Config::FromFile(options.lab), options.seed), plan.geometry);
  const auto run = [&](const std::vector<std::string>& enabled, std::uint64_t seed) {
    const auto lab = options.folder / "lab.toml";
    planning::WriteLabVariant(options.lab, enabled, false, lab);
    std::filesystem::remove_all(options.folder / "session");
    planning::ChainOptions chain;
    chain.lab = lab;
    chain.plan = options.plan;
    chain.folder = options.folder;
    chain.seed = seed;
    chain.keep_session = false;
    return planning::RunChain(chain).reconstruction;
  };

  core::Json rows = core::Json::array();
  const auto over_seeds = [&](const std::string& name, const std::vector<std::string>& enabled) {
    SeedStatistics statistics;
    Errors errors(lamp, truth);
    for (int k = 0; k < options.seeds; ++k) {
      core::ThrowIfInterrupted();
      const auto reconstruction = run(enabled, options.seed + static_cast<std::uint64_t>(k));
      statistics.Add(reconstruction.coefficients.data, reconstruction.sigma.data);
      errors.Add(reconstruction.coefficients);
    }
    const auto ratios = statistics.Ratios(truth.data);
    core::Json row = errors.Row(name);
    row["sigma_ratio"] = ratios[0];
    for (std::size_t quarter = 1; quarter < ratios.size(); ++quarter)
      row[fmt::format("sigma_ratio_q{}", quarter)] = ratios[quarter];
    rows.push_back(std::move(row));
  };
  std::vector<std::string> random;
  for (const auto& name : kRandomSources)
    if (has(name)) random.push_back(name);
  over_seeds("random", random);
  if (options.random_only) return rows;
  over_seeds("realistic", sources);

  const auto alone = [&](const std::string& name, const std::vector<std::string>& enabled) {
    core::ThrowIfInterrupted();
    Errors errors(lamp, truth);
    errors.Add(run(enabled, options.seed).coefficients);
    rows.push_back(errors.Row(name));
  };
  alone("quantisation", {});
  for (const auto& name : sources)
    if (std::find(random.begin(), random.end(), name) == random.end()) alone(name, {name});
  return rows;
}

}  // namespace luxfield::bench
