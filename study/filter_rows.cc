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

}  // namespace

nlohmann::json FilterRows(const std::filesystem::path& folder, int runs, int budgets,
                          std::uint64_t seed) {
  using reconstruct::ErrorSource;
  WriteBudgetLab(folder);
  const auto lab = folder / "lab.toml", variant = folder / "variant.toml",
             photographed = folder / "photographed.toml";
  WritePhotographingLab(lab, photographed);
  reconstruct::BudgetSettings settings;
  AskOfBudgetLab(&settings);
  const auto run_chain = [&](const std::vector<std::string>& errors) {
    // An ideal lab has no errors at all.
    WriteLabVariant(lab, errors, errors.empty(), variant, PrintErrors());
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

  std::vector<double> predicted(truth.size()), observed(truth.size());
  std::vector<std::string> names;
  core::Progress progress("photographs", static_cast<std::uint64_t>(runs));
  for (int run = 0; run < runs; ++run) {
    core::ThrowIfInterrupted();
    const FilterPhotographs photographs =
        PhotographFilter(photographed, seed + 1 + static_cast<std::uint64_t>(run), kPixels);
    const auto filter =
        reconstruct::MeasureFilter(photographs.sheet, photographs.light, photographs.prints);
    reconstruct::ReconstructOptions solve;
    solve.filter = &filter;
    const auto values =
        QuantitiesOf(reconstruct::Reconstruct(measurements, solve).coefficients, settings);
    for (std::size_t q = 0; q < truth.size(); ++q)
      observed[q] += std::pow(values[q] - truth[q], 2) / runs;
    if (run < budgets) {
      const auto budget = reconstruct::ComputeErrorBudget(session, settings, how, &filter);
      names.clear();
      for (std::size_t q = 0; q < truth.size(); ++q) {
        names.push_back(budget.quantities[q].name);
        for (const ErrorSource source :
             {ErrorSource::kFilterNoise, ErrorSource::kPrintShift, ErrorSource::kDensity})
          predicted[q] +=
              std::pow(budget.quantities[q].of(source).value_or(0), 2) / std::min(runs, budgets);
      }
    }
    progress.Advance();
  }
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t q = 0; q < truth.size(); ++q)
    rows.push_back(BudgetRow(kFilterSource, names[q], runs, truth[q], std::sqrt(predicted[q]),
                             std::sqrt(observed[q])));
  return rows;
}

}  // namespace luxfield::study
