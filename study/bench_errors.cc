#include "study/bench_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/json.h"
#include "core/progress.h"
#include "hal/sim/simulated_lab.h"
#include "study/chain.h"
#include "study/lab_variant.h"

namespace luxfield::study {
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

}  // namespace

nlohmann::json BenchErrors(const BenchErrorsOptions& options) {
  if (options.seeds < 2)
    throw InputError(
        fmt::format("--seeds = {} must be at least 2; a spread needs two", options.seeds));
  std::filesystem::create_directories(options.folder);
  const auto sources = ErrorSources(options.lab);
  const auto has = [&](const std::string& name) {
    return std::find(sources.begin(), sources.end(), name) != sources.end();
  };

  const capture::Plan plan = capture::ReadPlan(options.plan);
  const auto truth = hal::sim::SimulatedLab(options.lab, options.seed).truth(plan.geometry);
  const auto run = [&](const std::vector<std::string>& enabled, std::uint64_t seed) {
    const auto lab = options.folder / "lab.toml";
    WriteLabVariant(options.lab, enabled, false, lab);
    std::filesystem::remove_all(options.folder / "session");
    ChainOptions chain;
    chain.lab = lab;
    chain.plan = options.plan;
    chain.folder = options.folder;
    chain.seed = seed;
    chain.keep_session = false;
    return RunChain(chain).reconstruction;
  };

  core::Json rows = core::Json::array();
  const auto over_seeds = [&](const std::string& name, const std::vector<std::string>& enabled) {
    SeedStatistics statistics;
    double square_rmse = 0, square_l2 = 0;
    for (int k = 0; k < options.seeds; ++k) {
      core::ThrowIfInterrupted();
      const auto reconstruction = run(enabled, options.seed + static_cast<std::uint64_t>(k));
      statistics.Add(reconstruction.coefficients.data, reconstruction.sigma.data);
      const StageError error = CompareWithTruth(reconstruction.coefficients.data, truth.data);
      square_rmse += error.rel_rmse * error.rel_rmse / options.seeds;
      square_l2 += error.rel_l2 * error.rel_l2 / options.seeds;
    }
    const auto ratios = statistics.Ratios(truth.data);
    rows.push_back({{"case", name},
                    {"seeds", options.seeds},
                    {"rel_rmse", std::sqrt(square_rmse)},
                    {"rel_l2", std::sqrt(square_l2)},
                    {"sigma_ratio", ratios[0]},
                    {"sigma_ratio_q1", ratios[1]},
                    {"sigma_ratio_q2", ratios[2]},
                    {"sigma_ratio_q3", ratios[3]},
                    {"sigma_ratio_q4", ratios[4]}});
  };
  std::vector<std::string> random;
  for (const auto& name : kRandomSources)
    if (has(name)) random.push_back(name);
  over_seeds("random", random);
  if (options.random_only) return rows;
  over_seeds("realistic", sources);

  const auto alone = [&](const std::string& name, const std::vector<std::string>& enabled) {
    core::ThrowIfInterrupted();
    const StageError error =
        CompareWithTruth(run(enabled, options.seed).coefficients.data, truth.data);
    rows.push_back(
        {{"case", name}, {"seeds", 1}, {"rel_rmse", error.rel_rmse}, {"rel_l2", error.rel_l2}});
  };
  alone("quantisation", {});
  for (const auto& name : sources)
    if (std::find(random.begin(), random.end(), name) == random.end()) alone(name, {name});
  return rows;
}

}  // namespace luxfield::study
