#include "study/bench_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/json.h"
#include "core/progress.h"
#include "lightfield/light_vector.h"
#include "reconstruct/error_budget.h"
#include "study/budget_lab.h"
#include "study/chain.h"
#include "study/lab_variant.h"

namespace luxfield::study {
namespace {

using lightfield::LightField;

constexpr std::uint64_t kBudgetSeeds = 1u << 20;  // apart from those of the runs

// The quantities by the closed forms, in the order of the budget.
std::vector<double> Evaluate(const LightField& field, const reconstruct::BudgetSettings& asked) {
  std::vector<double> values{TotalFlux(field)[0]};
  for (const auto& ray : asked.rays) values.push_back(Radiance(field, ray.u_m, ray.s_m)[0]);
  for (const auto& at : asked.receivers)
    values.push_back(ExactIrradiance(field, at.p_m, at.normal)[0]);
  return values;
}

class MonteCarlo {
 public:
  explicit MonteCarlo(const BenchBudgetOptions& options) : options_(options) {
    WriteBudgetLab(options.folder);
    settings_.sizes = SizesOfLab(Lab());
    AskOfBudgetLab(&settings_);
    truth_ = Evaluate(Run("without errors", {}, true, options.seed, 0, false), settings_);
  }

  const std::vector<double>& truth() const { return truth_; }

  // Mean square deviations from the truth, per quantity.
  std::vector<double> Observe(const BudgetCase& what, core::Progress& progress) const {
    std::vector<double> squares(truth_.size());
    for (int run = 0; run < options_.runs; ++run) {
      core::ThrowIfInterrupted();
      const auto values =
          Evaluate(Run(what.name, what.enabled, false, options_.seed, run, false), settings_);
      for (std::size_t q = 0; q < values.size(); ++q)
        squares[q] += (values[q] - truth_[q]) * (values[q] - truth_[q]) / options_.runs;
      progress.Advance();
    }
    return squares;
  }

  // Mean squares of the predicted sigma, by source name; names of the quantities.
  std::map<std::string, std::vector<double>> Predict(std::vector<std::string>* names) const {
    std::map<std::string, std::vector<double>> squares;
    const BudgetCase all = BudgetCases().back();
    for (int run = 0; run < options_.budgets; ++run) {
      core::ThrowIfInterrupted();
      Run(all.name, all.enabled, false, options_.seed + kBudgetSeeds, run, true);
      reconstruct::MergeSessionOptions how;
      how.lamp_level = reconstruct::LampLevel::kMonitorUnity;
      const auto budget = reconstruct::ComputeErrorBudget(
          core::SessionReader(options_.folder / "session"), settings_, how);
      names->clear();
      for (std::size_t q = 0; q < budget.quantities.size(); ++q) {
        const auto& quantity = budget.quantities[q];
        names->push_back(quantity.name);
        const auto add = [&](const std::string& source, double sigma) {
          auto& all_quantities = squares[source];
          all_quantities.resize(budget.quantities.size());
          all_quantities[q] += sigma * sigma / options_.budgets;
        };
        for (int s = 0; s < reconstruct::kErrorSources; ++s)
          add(reconstruct::ErrorSourceName(static_cast<reconstruct::ErrorSource>(s)),
              quantity.sigma[static_cast<std::size_t>(s)].value_or(0));
        add(all.name, quantity.Total());
      }
    }
    return squares;
  }

 private:
  std::filesystem::path Lab() const { return options_.folder / "lab.toml"; }

  LightField Run(const std::string& source, const std::vector<std::string>& enabled, bool ideal,
                 std::uint64_t seed, int run, bool keep_session) const {
    const auto variant = options_.folder / "variant.toml";
    WriteLabVariant(Lab(), enabled, ideal, variant, DrawErrors(settings_.sizes, source, seed, run));
    std::filesystem::remove_all(options_.folder / "session");
    ChainOptions chain;
    chain.lab = variant;
    chain.plan = options_.folder / "plan.toml";
    chain.folder = options_.folder;
    chain.seed = seed + static_cast<std::uint64_t>(run);
    chain.keep_session = keep_session;
    return RunChain(chain).reconstruction.coefficients;
  }

  const BenchBudgetOptions& options_;
  reconstruct::BudgetSettings settings_;
  std::vector<double> truth_;
};

}  // namespace

nlohmann::json BenchBudget(const BenchBudgetOptions& options) {
  if (options.runs < 2 || options.budgets < 1)
    throw InputError(fmt::format("--runs = {} must be at least 2 and --budgets = {} at least 1",
                                 options.runs, options.budgets));
  std::vector<BudgetCase> cases;
  for (const BudgetCase& c : BudgetCases())
    if (options.sources.empty() ||
        std::find(options.sources.begin(), options.sources.end(), c.name) != options.sources.end())
      cases.push_back(c);
  if (cases.size() < options.sources.size())
    throw InputError("--source: one is not a source of the budget; leave it out to see them all");
  const MonteCarlo lab(options);
  std::vector<std::string> names;
  auto predicted = lab.Predict(&names);
  core::Json rows = core::Json::array();
  core::Progress progress("labs", cases.size() * static_cast<std::uint64_t>(options.runs));
  for (const BudgetCase& c : cases) {
    const auto observed = lab.Observe(c, progress);
    for (std::size_t q = 0; q < names.size(); ++q) {
      const double p = std::sqrt(predicted[c.name][q]), o = std::sqrt(observed[q]);
      rows.push_back({{"source", c.name},
                      {"quantity", names[q]},
                      {"runs", options.runs},
                      {"value", lab.truth()[q]},
                      {"predicted", p},
                      {"observed", o},
                      {"ratio", p / o},
                      {"error", 1 / std::sqrt(2.0 * options.runs)},
                      {"share", o / std::abs(lab.truth()[q])}});
    }
  }
  return rows;
}

}  // namespace luxfield::study
