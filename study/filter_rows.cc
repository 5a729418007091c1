#include "study/filter_rows.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "core/file.h"
#include "core/json.h"
#include "core/progress.h"
#include "reconstruct/error_budget.h"
#include "reconstruct/measure_filter.h"
#include "study/budget_lab.h"
#include "study/chain.h"
#include "study/filter_photographs.h"
#include "study/lab_variant.h"

namespace luxfield::study {
namespace {

using hal::sim::FilterBench;
using lightfield::MeasuredFilter;

constexpr int kPixels = 320;  // of the photographs, a side
// A tenth of the lab's full well: noise is to be seen above what texels round off.
constexpr double kGain_dn_per_e = 6.4;

// The print as a lab file has it.
std::vector<LabNumbers> PrintErrors() {
  return {{"registration", "shift_m", {2e-4, -1e-4}},
          {"density", "relative", {0.02}},
          {"density", "gamma", {0.01}},
          {"density", "grain", {0}}};  // its pattern would be another bench's
}

// The lab on whose bench the print is photographed.
void WritePhotographingLab(const std::filesystem::path& lab, const std::filesystem::path& variant) {
  WriteLabVariant(lab, {"registration", "density", "photon_noise", "read_noise"}, false, variant,
                  PrintErrors());
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
  const double known = bench.Light(View::kPlus) / bench.Light(View::kLight),
               factor = readings.prints[0].light_ratio / known;
  for (float& t : filter.prints[0].transmittance) t = static_cast<float>(factor * t);
  return filter;
}

// Mean squares of one kind of row, per quantity.
struct Sums {
  std::string source;
  std::vector<reconstruct::ErrorSource> of;  // that `predicted` is the sum of
  std::vector<double> predicted{}, observed{};
};

}  // namespace

nlohmann::json FilterRows(const std::filesystem::path& folder, int runs, int budgets,
                          std::uint64_t seed) {
  using reconstruct::ErrorSource;
  WriteBudgetLab(folder, false);
  const auto lab = folder / "lab.toml", variant = folder / "variant.toml",
             photographed = folder / "photographed.toml";
  WritePhotographingLab(lab, photographed);
  reconstruct::BudgetSettings settings;
  AskOfBudgetLab(&settings);
  const auto run_chain = [&](const std::vector<std::string>& errors) {
    WriteLabVariant(lab, errors, false, variant, PrintErrors());
    std::filesystem::remove_all(folder / "session");
    ChainOptions chain;
    chain.lab = variant;
    chain.plan = folder / "plan.toml";
    chain.folder = folder;
    chain.seed = seed;
    return RunChain(chain);
  };
  const auto truth = QuantitiesOf(run_chain({}).reconstruction.coefficients, settings);
  const auto measurements = run_chain({"registration", "density"}).measurements;
  const core::SessionReader session(folder / "session");
  reconstruct::MergeSessionOptions how;
  how.lamp_level = reconstruct::LampLevel::kMonitorUnity;

  Sums measured{kFilterSource,
                {ErrorSource::kFilterNoise, ErrorSource::kPrintShift, ErrorSource::kDensity}};
  Sums known{std::string(kFilterSource) + ", level known",
             {ErrorSource::kFilterNoise, ErrorSource::kPrintShift}};
  for (Sums* sums : {&measured, &known}) {
    sums->predicted.resize(truth.size());
    sums->observed.resize(truth.size());
  }
  const auto observe = [&](const MeasuredFilter& filter, Sums* sums) {
    reconstruct::ReconstructOptions solve;
    solve.filter = &filter;
    const auto values =
        QuantitiesOf(reconstruct::Reconstruct(measurements, solve).coefficients, settings);
    for (std::size_t q = 0; q < truth.size(); ++q)
      sums->observed[q] += std::pow(values[q] - truth[q], 2) / runs;
  };
  const auto predict = [&](const reconstruct::ErrorBudget& budget, Sums* sums) {
    for (std::size_t q = 0; q < truth.size(); ++q)
      for (const ErrorSource source : sums->of)
        sums->predicted[q] +=
            std::pow(budget.quantities[q].of(source).value_or(0), 2) / std::min(runs, budgets);
  };
  std::vector<std::string> names;
  core::Progress progress("photographs", static_cast<std::uint64_t>(runs));
  for (int run = 0; run < runs; ++run) {
    core::ThrowIfInterrupted();
    const FilterBench bench(hal::sim::ReadLab(core::Config::FromFile(photographed),
                                              seed + 1 + static_cast<std::uint64_t>(run)),
                            kPixels);
    const FilterPhotographs photographs = PhotographFilter(bench);
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
  for (const Sums& sums : {measured, known})
    for (std::size_t q = 0; q < truth.size(); ++q)
      rows.push_back(BudgetRow(sums.source, names[q], runs, truth[q], std::sqrt(sums.predicted[q]),
                               std::sqrt(sums.observed[q])));
  return rows;
}

}  // namespace luxfield::study
