#include "luxfield/bench/bench_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "luxfield/bench/budget_lab.h"
#include "luxfield/bench/filter_rows.h"
#include "luxfield/bench/missing_rows.h"
#include "luxfield/bench/spot_total_rows.h"
#include "luxfield/bench/truncation_rows.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/reconstruct/budget/error_budget.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::bench {
namespace {

using lightfield::LightField;

constexpr std::uint64_t kBudgetSeeds = 1u << 20;  // apart from those of the runs
constexpr const char* kNone = "no error";         // of lab or geometry

// In groups of one lab, whose cases can share sessions.
std::vector<std::vector<BudgetCase>> ByLab(const std::vector<BudgetCase>& cases) {
  std::vector<std::vector<BudgetCase>> groups;
  for (const BudgetCase& c : cases) {
    const auto group = std::find_if(groups.begin(), groups.end(),
                                    [&](const auto& g) { return LabOf(g.front()) == LabOf(c); });
    if (group == groups.end())
      groups.push_back({c});
    else
      group->push_back(c);
  }
  return groups;
}

// One lab, and one way to take its exposure times.
class MonteCarlo {
 public:
  MonteCarlo(const BenchBudgetOptions& options, bool estimated)
      : options_(options), estimated_(estimated) {
    WriteBudgetLab(options.folder, options.dual, estimated ? Ladder::kLong : Ladder::kShort);
    settings_.sizes = SizesOfLab(Lab());
    settings_.sizes.estimate_basis = false;  // the lamp is in the span
    AskOfBudgetLab(&settings_);
    Capture({kNone, {}}, true, options.seed, 0);
    const LightField truth = Reconstructed(kNone, options.seed, 0);
    truth_ = QuantitiesOf(truth, settings_);
    true_readings_ = Readings(truth);
  }

  nlohmann::json Rows(const std::vector<BudgetCase>& cases) const {
    std::vector<std::string> names;
    auto predicted = Predict(&names);
    core::Progress progress("labs", cases.size() * static_cast<std::uint64_t>(options_.runs));
    nlohmann::json rows = nlohmann::json::array();
    std::map<std::string, std::vector<double>> observed;
    for (const auto& group : ByLab(cases)) {
      auto squares = Observe(group, progress);
      for (std::size_t c = 0; c < group.size(); ++c)
        observed[group[c].name] = std::move(squares[c]);
    }
    for (const BudgetCase& c : cases)
      for (std::size_t q = 0; q < names.size(); ++q)
        rows.push_back(BudgetRow(c.Label(), names[q], options_.runs, truth_[q],
                                 std::sqrt(predicted[c.name][q]), std::sqrt(observed[c.name][q])));
    return rows;
  }

 private:
  // Mean square deviations from the truth, per case and quantity. The cases share every run's
  // session: they are of one lab (LabOf).
  std::vector<std::vector<double>> Observe(const std::vector<BudgetCase>& cases,
                                           core::Progress& progress) const {
    std::vector<std::vector<double>> squares(cases.size(), std::vector<double>(truth_.size()));
    for (int run = 0; run < options_.runs; ++run) {
      core::ThrowIfInterrupted();
      Capture(cases.front(), false, options_.seed, run);
      for (std::size_t c = 0; c < cases.size(); ++c) {
        const auto values = Observed(cases[c], run),
                   truth = cases[c].beside_others
                               ? QuantitiesOf(Reconstructed(kNone, options_.seed, run), settings_)
                               : truth_;
        for (std::size_t q = 0; q < values.size(); ++q)
          squares[c][q] += (values[q] - truth[q]) * (values[q] - truth[q]) / options_.runs;
        progress.Advance();
      }
    }
    return squares;
  }

  // Mean squares of the predicted sigma, by case; names of the quantities.
  std::map<std::string, std::vector<double>> Predict(std::vector<std::string>* names) const {
    using reconstruct::ErrorSource;
    std::map<std::string, std::vector<double>> squares;
    for (int run = 0; run < options_.budgets; ++run) {
      core::ThrowIfInterrupted();
      Capture({kTotal, AllErrors()}, false, options_.seed + kBudgetSeeds, run);
      WriteGeometryOfRun(Geometry(), settings_.sizes, kTotal, options_.seed + kBudgetSeeds, run);
      const auto how = HowToMerge(estimated_);
      const session::SessionReader session(Session());
      const auto budget = reconstruct::ComputeErrorBudget(session, settings_, how);
      // One row is judged by itself: with the meter; or, of estimated times, all but the longest,
      // which cannot be wrong in a session whose noise is to be that of another.
      auto other = settings_;
      const ErrorSource apart = estimated_ ? ErrorSource::kExposureTimes : ErrorSource::kMeter;
      if (estimated_) {
        other.sizes.exposure_time_s.reset();
      } else {
        other.meter = MeterOfBudgetLab();
        ReadMeter(&*other.meter, true_readings_, options_.seed + kBudgetSeeds, run);
      }
      const auto other_budget = reconstruct::ComputeErrorBudget(session, other, how);
      names->clear();
      for (std::size_t q = 0; q < budget.quantities.size(); ++q) {
        const auto& quantity = budget.quantities[q];
        const auto& other_quantity = other_budget.quantities[q];
        names->push_back(quantity.name);
        const auto add = [&](const std::string& what, double sigma) {
          auto& all_quantities = squares[what];
          all_quantities.resize(budget.quantities.size());
          all_quantities[q] += sigma * sigma / options_.budgets;
        };
        for (int s = 0; s < reconstruct::kErrorSources; ++s) {
          const auto source = static_cast<ErrorSource>(s);
          add(reconstruct::ErrorSourceName(source),
              (source == apart ? other_quantity : quantity).of(source).value_or(0));
        }
        add(kTotal, quantity.Total());
        add(kScaledTotal, other_quantity.Total());
      }
    }
    if (!estimated_)
      squares[reconstruct::ErrorSourceName(ErrorSource::kExposureTimes)] = PredictExposureTimes();
    return squares;
  }

  // What wrong times do depends on the rungs that a place takes, which noise decides near a rung's
  // edge: from sessions with their errors alone, as the observed ones are.
  std::vector<double> PredictExposureTimes() const {
    using reconstruct::ErrorSource;
    const std::string name = reconstruct::ErrorSourceName(ErrorSource::kExposureTimes);
    const auto cases = BudgetCases();
    const auto own = std::find_if(cases.begin(), cases.end(),
                                  [&](const BudgetCase& c) { return c.Label() == name; });
    std::vector<double> squares(truth_.size());
    for (int run = 0; run < options_.budgets; ++run) {
      core::ThrowIfInterrupted();
      Capture(*own, false, options_.seed + kBudgetSeeds, run);
      WriteGeometryOfRun(Geometry(), settings_.sizes, name, options_.seed + kBudgetSeeds, run);
      const auto budget = reconstruct::ComputeErrorBudget(session::SessionReader(Session()),
                                                          settings_, HowToMerge(estimated_));
      for (std::size_t q = 0; q < squares.size(); ++q)
        squares[q] +=
            std::pow(*budget.quantities[q].of(ErrorSource::kExposureTimes), 2) / options_.budgets;
    }
    return squares;
  }

  std::filesystem::path Lab() const { return options_.folder / "lab.toml"; }
  std::filesystem::path Session() const { return options_.folder / "session"; }
  std::filesystem::path Geometry() const { return options_.folder / "geometry.cal.json"; }

  std::vector<double> Readings(const LightField& field) const {
    std::vector<double> values;
    for (const auto& reading : MeterOfBudgetLab().readings)
      values.push_back(ExactIrradiance(field, reading.at.p_m, reading.at.normal)[0]);
    return values;
  }

  // What the readings of a run say the field is to be multiplied by: least squares, weighted.
  double MeterFactor(const LightField& field, int run) const {
    auto meter = MeterOfBudgetLab();
    ReadMeter(&meter, true_readings_, options_.seed, run);
    const auto seen = Readings(field);
    double above = 0, below = 0;
    for (std::size_t n = 0; n < seen.size(); ++n) {
      const double weight = std::pow(meter.readings[n].sigma, -2);
      above += weight * seen[n] * meter.readings[n].value;
      below += weight * seen[n] * seen[n];
    }
    return above / below;
  }

  // The session of a run of a case, in place of the one before.
  void Capture(const BudgetCase& what, bool ideal, std::uint64_t seed, int run) const {
    const auto variant = options_.folder / "variant.toml";
    planning::WriteLabVariant(Lab(), what.enabled, ideal, variant,
                              DrawErrors(settings_.sizes, LabOf(what), seed, run));
    std::filesystem::remove_all(Session());
    hal::Devices devices = hal::MakeDevices(variant, seed + static_cast<std::uint64_t>(run));
    capture::RunCapture(capture::ReadPlan(options_.folder / "plan.toml"), devices, Session());
  }

  // The session with a geometry that is off as in the runs of `source`; kNone: with exposure times
  // that are right as well.
  LightField Reconstructed(const std::string& source, std::uint64_t seed, int run) const {
    WriteGeometryOfRun(Geometry(), settings_.sizes, source, seed, run);
    return reconstruct::Reconstruct(
               reconstruct::MergeSession(session::SessionReader(Session()),
                                         HowToMerge(estimated_ && source != kNone)))
        .coefficients;
  }

  std::vector<double> Observed(const BudgetCase& what, int run) const {
    const LightField field = Reconstructed(what.name, options_.seed, run);
    auto values = QuantitiesOf(field, settings_);
    if (what.scaled) {
      const double factor = MeterFactor(field, run);
      for (double& value : values) value *= factor;
    }
    return values;
  }

  reconstruct::MergeSessionOptions HowToMerge(bool estimated) const {
    reconstruct::MergeSessionOptions how;
    how.lamp_level = reconstruct::LampLevel::kMonitorUnity;  // the truth is the lamp at its level
    how.calibrations = {Geometry()};
    how.estimate_exposures = estimated;
    return how;
  }

  const BenchBudgetOptions& options_;
  bool estimated_;
  reconstruct::BudgetSettings settings_;
  std::vector<double> truth_, true_readings_;
};

}  // namespace

nlohmann::json BenchBudget(const BenchBudgetOptions& options) {
  if (options.runs < 2 || options.budgets < 1)
    throw InputError(fmt::format("--runs = {} must be at least 2 and --budgets = {} at least 1",
                                 options.runs, options.budgets));
  std::vector<BudgetCase> cases;
  for (const BudgetCase& c : BudgetCases())
    if (options.sources.empty() || std::find(options.sources.begin(), options.sources.end(),
                                             c.Label()) != options.sources.end())
      cases.push_back(c);
  const auto asked = [&](const std::string& name) {
    return std::find(options.sources.begin(), options.sources.end(), name) != options.sources.end();
  };
  const bool basis = options.sources.empty() || asked(kBasisSource),
             estimated_basis = options.sources.empty() || asked(kEstimatedBasisSource),
             missing = options.sources.empty() || asked(kMissingSource),
             with_basis = options.sources.empty() || asked(kTotalWithBasis),
             filter = options.sources.empty() || asked(kFilterSource);
  if (cases.size() + asked(kMissingSource) + asked(kBasisSource) + asked(kEstimatedBasisSource) +
          asked(kTotalWithBasis) + asked(kFilterSource) <
      options.sources.size())
    throw InputError("--source: one is not a source of the budget; leave it out to see them all");
  core::Json rows = core::Json::array();
  const auto add = [&](const nlohmann::json& more) {
    for (const auto& row : more) rows.push_back(row);
  };
  if (missing) add(MissingRows(options.runs, options.seed, options.dual));
  if (basis) add(TruncationRows(options.folder, options.runs, options.seed, options.dual, false));
  if (estimated_basis)
    add(TruncationRows(options.folder, options.runs, options.seed, options.dual, true));
  if (with_basis) add(SpotTotalRows(options.folder, options.runs, options.seed, options.dual));
  if (filter)
    add(FilterRows(options.folder, options.runs, options.budgets, options.seed, options.dual));
  for (const bool estimated : {false, true}) {
    std::vector<BudgetCase> of_lab;
    for (const BudgetCase& c : cases)
      if (c.estimated == estimated) of_lab.push_back(c);
    if (!of_lab.empty()) add(MonteCarlo(options, estimated).Rows(of_lab));
  }
  return rows;
}

}  // namespace luxfield::bench
