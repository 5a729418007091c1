// The error budget of a camera with a colour mosaic against the scatter of simulated labs.
// LUXFIELD_LABS=100 draws more of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "luxfield/bench/budget_lab.h"
#include "luxfield/core/file.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/budget/error_budget.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

namespace fs = std::filesystem;

void Replace(std::string& text, const std::string& from, const std::string& to) {
  ASSERT_NE(text.find(from), std::string::npos) << from;
  text.replace(text.find(from), from.size(), to);
}

// The budget's lab with a Bayer sensor whose sites are as far apart as its pixels were, and a lamp
// of three colours that differ from filter to filter.
void WriteBayerLab(const fs::path& folder) {
  bench::WriteBudgetLab(folder, false);
  const lightfield::LightField grey = lightfield::ReadLightField(folder / "lamp.lf.exr");
  lightfield::LuminaireGeometry geometry = grey.geometry;
  geometry.channels = 3;
  lightfield::LightField lamp(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int channel = 0; channel < 3; ++channel) {
      const double factor = 1 - 0.25 * channel + 0.06 * ((m * (channel + 2)) % 5);
      const auto from = grey.image(m, 0);
      auto to = lamp.image(m, channel);
      for (std::size_t k = 0; k < to.size(); ++k) to[k] = static_cast<float>(factor * from[k]);
    }
  lightfield::WriteLightField(folder / "lamp.lf.exr", lamp);
  std::string lab = core::ReadFile(folder / "lab.toml"),
              plan = core::ReadFile(folder / "plan.toml");
  Replace(lab, "[lab]\n", "[lab]\nchannels = 3\n");
  Replace(lab, "width = 32\nheight = 32\npitch_m = 0.01\n",
          "width = 64\nheight = 64\npitch_m = 0.005\ncfa = \"GBRG\"\n");
  Replace(lab, "[2000]", "[1500, 2000, 1100]");
  Replace(plan, "channels = 1\n", "channels = 3\n");
  core::WriteFileAtomically(folder / "lab.toml", lab);
  core::WriteFileAtomically(folder / "plan.toml", plan);
}

reconstruct::ErrorBudget BudgetOf(const fs::path& folder, const fs::path& lab, std::uint64_t seed,
                                  const reconstruct::BudgetSettings& settings) {
  const fs::path session = folder / "session";
  fs::remove_all(session);
  core::SetInterruptCountForTest(0);
  hal::Devices devices = hal::sim::SimulatedLab(lab, seed).MakeDevices();
  capture::RunCapture(capture::ReadPlan(folder / "plan.toml"), devices, session);
  return reconstruct::ComputeErrorBudget(session::SessionReader(session), settings);
}

// Quantile of chi^2 / degrees by Wilson and Hilferty (1931), good to 1 % here.
double ChiSquaredShare(int degrees, double z) {
  const double v = 2.0 / (9.0 * degrees);
  return std::pow(1 - v + z * std::sqrt(v), 3);
}

TEST(MosaicBudget, PredictsTheScatterOfBayerLabs) {
  using reconstruct::ErrorSource;
  const char* text = std::getenv("LUXFIELD_LABS");
  const int runs = text ? std::max(2, std::atoi(text)) : 8;
  const ScratchFolder scratch("mosaic_budget");
  const fs::path folder = scratch.path(), lab = folder / "lab.toml",
                 variant = folder / "variant.toml";
  WriteBayerLab(folder);
  reconstruct::BudgetSettings settings;
  bench::AskOfBudgetLab(&settings);
  settings.sizes = bench::SizesOfLab(lab);
  planning::WriteLabVariant(lab, {}, true, variant);
  const auto truth = BudgetOf(folder, variant, 1, settings).quantities;
  struct Case {
    ErrorSource source;
    std::vector<std::string> enabled;
  };
  double pooled = 0;
  int figures = 0;
  for (const Case& c :
       {Case{ErrorSource::kPhotonNoise, {"photon_noise"}},
        Case{ErrorSource::kReadNoise, {"read_noise", "dark_current"}},
        Case{ErrorSource::kPrnu, {"prnu"}}, Case{ErrorSource::kShutter, {"shutter"}},
        Case{ErrorSource::kStage, {"stage"}}}) {
    planning::WriteLabVariant(lab, c.enabled, false, variant);
    std::vector<double> square(truth.size()), predicted(truth.size());
    for (int run = 0; run < runs; ++run) {
      const auto quantities = BudgetOf(folder, variant, 100 + run, settings).quantities;
      for (std::size_t q = 0; q < truth.size(); ++q) {
        square[q] += std::pow(quantities[q].value - truth[q].value, 2) / runs;
        predicted[q] += std::pow(*quantities[q].of(c.source), 2) / runs;
      }
    }
    for (std::size_t q = 0; q < truth.size(); ++q) {
      const double share = square[q] / predicted[q];
      std::printf("%-12s %-12s predicted %.4f %%, observed %.4f %%\n", ErrorSourceName(c.source),
                  truth[q].name.c_str(), 100 * std::sqrt(predicted[q]) / truth[q].value,
                  100 * std::sqrt(square[q]) / truth[q].value);
      // 1e-5 a side, 25 figures.
      EXPECT_GT(share, ChiSquaredShare(runs, -4.265));
      EXPECT_LT(share, ChiSquaredShare(runs, 4.265));
      pooled += share;
      ++figures;
    }
  }
  std::printf("seeds 100 to %d; mean square over predicted %.3f\n", 100 + runs - 1,
              pooled / figures);
}

}  // namespace
}  // namespace luxfield::planning
