#include "luxfield/bench/filter_rows.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "luxfield/bench/budget_lab.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/filter_photographs.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/reconstruct/budget/error_budget.h"
#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"

namespace luxfield::bench {
namespace {

using hal::sim::FilterBench;
using lightfield::MeasuredFilter;

constexpr int kPixels = 320;  // of the photographs, a side
// A tenth of the lab's full well: noise is to be seen above what texels round off.
constexpr double kGain_dn_per_e = 6.4;

// The print as a lab file has it. A pair stays in its place: the edges of a displaced one fall
// between the simulated lab's nodes, 0.06 % of the flux, as much as the level leaves open.
std::vector<planning::LabNumbers> PrintErrors(bool dual) {
  return {{"registration", "shift_m", dual ? std::vector<double>{0, 0} : std::vector{2e-4, -1e-4}},
          {"density", "relative", {0.02}},
          {"density", "gamma", {0.01}},
          {"density", "grain", {0}}};  // its pattern would be another bench's
}

// The lab on whose bench the print is photographed.
void WritePhotographingLab(const std::filesystem::path& lab, bool dual,
                           const std::filesystem::path& variant) {
  planning::WriteLabVariant(lab, {"registration", "density", "photon_noise", "read_noise"}, false,
                            variant, PrintErrors(dual));
  toml::table table = toml::parse(core::ReadFile(variant));
  table["camera"].as_table()->insert_or_assign("gain_dn_per_e", kGain_dn_per_e);
  std::ostringstream text;
  text << table << '\n';
  core::WriteFileAtomically(variant, text.str());
}

// T over the ratio that the light really had between the photographs, not the one measured.
MeasuredFilter AtKnownLevel(MeasuredFilter filter, const reconstruct::FilterReadings& readings,
                            const FilterBench& bench) {
  using View = FilterBench::View;
  for (std::size_t k = 0; k < filter.prints.size(); ++k) {
    const double known =
                     bench.Light(k == 0 ? View::kPlus : View::kMinus) / bench.Light(View::kLight),
                 factor = readings.prints[k].light_ratio / known;
    for (float& t : filter.prints[k].transmittance) t = static_cast<float>(factor * t);
  }
  return filter;
}

// Of one kind of row, per quantity: mean squares, and the deviations' mean.
struct Means {
  std::string source;
  std::vector<reconstruct::ErrorSource> of;  // that `predicted` is the sum of
  std::vector<double> predicted{}, observed{}, deviation{};
};

}  // namespace

nlohmann::json FilterRows(const std::filesystem::path& folder, int runs, int budgets,
                          std::uint64_t seed, bool dual) {
  using reconstruct::ErrorSource;
  WriteBudgetLab(folder, dual);
  const auto lab = folder / "lab.toml", variant = folder / "variant.toml",
             photographed = folder / "photographed.toml";
  WritePhotographingLab(lab, dual, photographed);
  reconstruct::BudgetSettings settings;
  AskOfBudgetLab(&settings);
  const auto run_chain = [&](const std::vector<std::string>& errors) {
    planning::WriteLabVariant(lab, errors, false, variant, PrintErrors(dual));
    std::filesystem::remove_all(folder / "session");
    planning::ChainOptions chain;
    chain.lab = variant;
    chain.plan = folder / "plan.toml";
    chain.folder = folder;
    chain.seed = seed;
    return planning::RunChain(chain);
  };
  const auto truth = QuantitiesOf(run_chain({}).reconstruction.coefficients, settings);
  const auto measurements = run_chain({"registration", "density"}).measurements;
  const session::SessionReader session(folder / "session");
  reconstruct::MergeSessionOptions how;
  how.lamp_level = reconstruct::LampLevel::kMonitorUnity;

  Means measured{kFilterSource,
                 {ErrorSource::kFilterNoise, ErrorSource::kPrintShift, ErrorSource::kDensity}};
  Means known{std::string(kFilterSource) + ", level known",
              {ErrorSource::kFilterNoise, ErrorSource::kPrintShift}};
  for (Means* means : {&measured, &known}) {
    means->predicted.resize(truth.size());
    means->observed.resize(truth.size());
    means->deviation.resize(truth.size());
  }
  const auto observe = [&](const MeasuredFilter& filter, Means* means) {
    reconstruct::ReconstructOptions solve;
    solve.filter = &filter;
    const auto values =
        QuantitiesOf(reconstruct::Reconstruct(measurements, solve).coefficients, settings);
    for (std::size_t q = 0; q < truth.size(); ++q) {
      means->observed[q] += std::pow(values[q] - truth[q], 2) / runs;
      means->deviation[q] += (values[q] - truth[q]) / runs;
    }
  };
  const auto predict = [&](const reconstruct::ErrorBudget& budget, Means* means) {
    for (std::size_t q = 0; q < truth.size(); ++q)
      for (const ErrorSource source : means->of)
        means->predicted[q] +=
            std::pow(budget.quantities[q].of(source).value_or(0), 2) / std::min(runs, budgets);
  };
  std::vector<std::string> names;
  core::Progress progress("photographs", static_cast<std::uint64_t>(runs));
  for (int run = 0; run < runs; ++run) {
    core::ThrowIfInterrupted();
    const FilterBench bench(hal::sim::ReadLab(core::Config::FromFile(photographed),
                                              seed + 1 + static_cast<std::uint64_t>(run)),
                            kPixels);
    const reconstruct::FilterPhotographs photographs = planning::PhotographFilter(bench);
    reconstruct::FilterReadings readings;
    const auto filter = reconstruct::MeasureFilter(photographs.sheet, photographs.light,
                                                   photographs.prints, &readings);
    observe(filter, &measured);
    observe(AtKnownLevel(filter, readings, bench), &known);
    if (run < budgets) {
      const auto budget = reconstruct::ComputeErrorBudget(session, settings, how, &filter);
      predict(budget, &measured);
      predict(budget, &known);
      names.clear();
      for (const auto& quantity : budget.quantities) names.push_back(quantity.name);
    }
    progress.Advance();
  }
  nlohmann::json rows = nlohmann::json::array();
  const auto add = [&](const Means& means, std::size_t q, double observed) -> nlohmann::json& {
    rows.push_back(BudgetRow(means.source, names[q], runs, truth[q], std::sqrt(means.predicted[q]),
                             std::sqrt(observed)));
    return rows.back();
  };
  for (std::size_t q = 0; q < truth.size(); ++q) add(measured, q, measured.observed[q]);
  for (std::size_t q = 0; q < truth.size(); ++q) {
    const double mean = known.deviation[q];
    add(known, q, (known.observed[q] - mean * mean) * runs / (runs - 1))["bias"] = mean / truth[q];
  }
  return rows;
}

}  // namespace luxfield::bench
