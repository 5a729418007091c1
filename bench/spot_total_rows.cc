#include "luxfield/bench/spot_total_rows.h"

#include <cmath>
#include <vector>

#include "luxfield/bench/budget_lab.h"
#include "luxfield/bench/mean_squares.h"
#include "luxfield/bench/spot_lamp.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/reconstruct/budget/error_budget.h"

namespace luxfield::bench {

nlohmann::json SpotTotalRows(const std::filesystem::path& folder, int runs, std::uint64_t seed,
                             bool dual) {
  constexpr int kFilters = 5;
  const lightfield::LuminaireGeometry plan = WriteBudgetLab(folder, dual, kFilters);
  const double spacing_m = plan.grid.spacing_m;
  const SpotLampOptions spots{0.5 * spacing_m, 1.5 * spacing_m, 0.7 * spacing_m, 0.06};
  reconstruct::BudgetSettings settings;
  settings.sizes = SizesOfLab(folder / "lab.toml");
  settings.sizes.smallest_spot_m = spots.smallest_m;
  AskOfBudgetLab(&settings);
  const BudgetCase all = BudgetCases().back();

  planning::ChainOptions chain;
  chain.lab = folder / "variant.toml";
  chain.plan = folder / "plan.toml";
  chain.folder = folder;
  chain.calibrations = {folder / "geometry.cal.json"};
  reconstruct::MergeSessionOptions how;
  how.lamp_level = reconstruct::LampLevel::kMonitorUnity;
  how.calibrations = chain.calibrations;
  MeanSquares squares(kTotalWithBasis);
  core::Progress progress("lamps", static_cast<std::uint64_t>(runs));
  for (int run = 0; run < runs; ++run) {
    core::ThrowIfInterrupted();
    const lightfield::LightField lamp = SpotLamp(plan, spots, seed, run);
    lightfield::WriteLightField(folder / "lamp.lf.exr", lamp);
    planning::WriteLabVariant(folder / "lab.toml", all.enabled, false, chain.lab,
                              DrawErrors(settings.sizes, all.name, seed, run));
    WriteGeometryOfRun(chain.calibrations[0], settings.sizes, all.name, seed, run);
    std::filesystem::remove_all(folder / "session");
    chain.seed = seed + static_cast<std::uint64_t>(run);
    planning::RunChain(chain);
    const auto budget =
        ComputeErrorBudget(session::SessionReader(folder / "session"), settings, how);
    const std::vector<double> truth = QuantitiesOf(lamp, settings);
    for (std::size_t q = 0; q < truth.size(); ++q) {
      const auto& quantity = budget.quantities[q];
      squares.Add(quantity.name, truth[q], quantity.Total(), quantity.value - truth[q]);
    }
    progress.Advance();
  }
  return squares.Rows();
}

}  // namespace luxfield::bench
