#include "luxfield/bench/bench_filters.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/planning/chain.h"
#include "luxfield/planning/filter_photographs.h"
#include "luxfield/planning/lab_variant.h"
#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"
#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::bench {
namespace {

constexpr double kGrain = 0.005;
// Nodes of the simulated lab's quadrature over a filter's cell: a turned print's edges lie between
// any, and what 4 of them miss of a dual pair is more than a measurement's noise.
constexpr std::int64_t kNodes = 12;

// The lab with random sources, the lamp from a light field, and a print with these errors.
void WriteLab(const BenchFiltersOptions& options, const std::filesystem::path& lamp,
              double spacing_m, bool errors, const std::filesystem::path& variant) {
  const auto sources = planning::ErrorSources(options.lab);
  std::vector<std::string> random;
  for (const char* name : {"photon_noise", "read_noise", "dark_current", "prnu"})
    if (std::find(sources.begin(), sources.end(), name) != sources.end()) random.emplace_back(name);
  planning::WriteLabVariant(options.lab, random, false, variant);
  toml::table table = toml::parse(core::ReadFile(variant));
  table.insert_or_assign("lamp", toml::table{{"kind", "lightfield"},
                                             {"file", std::filesystem::absolute(lamp).string()}});
  if (!table.contains("sampling")) table.insert("sampling", toml::table{});
  toml::table& sampling = *table["sampling"].as_table();
  sampling.insert_or_assign("u_per_cell",
                            std::max(kNodes, sampling["u_per_cell"].value_or(kNodes)));
  if (errors) {
    const double shift_m = options.registration * spacing_m / std::numbers::sqrt2;
    if (!table.contains("errors")) table.insert("errors", toml::table{});
    toml::table& all = *table["errors"].as_table();
    all.insert_or_assign("registration", toml::table{{"shift_m", toml::array{shift_m, -shift_m}},
                                                     {"rotation_deg", 0.1}});
    all.insert_or_assign("density", toml::table{{"relative", options.density},
                                                {"gamma", 0.01},
                                                {"grain", kGrain},
                                                {"grain_size_m", spacing_m / 30}});
  }
  std::ostringstream text;
  text << table << '\n';
  core::WriteFileAtomically(variant, text.str());
}

}  // namespace

nlohmann::json BenchFilters(const BenchFiltersOptions& options) {
  std::filesystem::create_directories(options.folder);
  const capture::Plan plan = capture::ReadPlan(options.plan);
  const auto lamp_file = options.folder / "lamp.lf.exr";
  auto lamp = hal::sim::SimulatedLab(options.lab, options.seed).truth(plan.geometry);
  std::vector<float*> images;
  for (int m = 0; m < lamp.geometry.grid.count(); ++m) images.push_back(lamp.image(m, 0).data());
  reconstruct::ProjectNonNegative(reconstruct::GramSolver(lamp.geometry.grid), images.data(),
                                  lamp.geometry.plane_size() * lamp.geometry.channels);
  lightfield::WriteLightField(lamp_file, lamp);
  const auto perfect = options.folder / "perfect.toml", wrong = options.folder / "wrong.toml";
  WriteLab(options, lamp_file, plan.geometry.grid.spacing_m, false, perfect);
  WriteLab(options, lamp_file, plan.geometry.grid.spacing_m, true, wrong);

  core::Json rows = core::Json::array();
  double floor = 0;
  const auto add = [&](const std::string& name, const reconstruct::Reconstruction& result) {
    const planning::StageError error =
        planning::CompareWithTruth(result.coefficients.data, lamp.data);
    if (floor == 0) floor = error.rel_l2;
    rows.push_back({{"case", name},
                    {"rel_rmse", error.rel_rmse},
                    {"rel_l2", error.rel_l2},
                    {"over_floor", error.rel_l2 / floor},
                    {"solve", result.report.solve},
                    {"condition", result.report.condition},
                    {"noise_gain", result.report.noise_gain}});
  };
  const auto run = [&](const std::filesystem::path& lab) {
    core::ThrowIfInterrupted();
    std::filesystem::remove_all(options.folder / "session");
    planning::ChainOptions chain;
    chain.lab = lab;
    chain.plan = options.plan;
    chain.folder = options.folder;
    chain.seed = options.seed;
    chain.keep_session = false;
    return planning::RunChain(chain);
  };
  add("perfect print, ideal filter assumed", run(perfect).reconstruction);
  const planning::ChainResult measured = run(wrong);
  add("print with errors, ideal filter assumed", measured.reconstruction);

  const reconstruct::FilterPhotographs photographs =
      planning::PhotographFilter(wrong, options.seed, options.pixels);
  reconstruct::FilterReadings readings;
  const auto filter_file = options.folder / "bench.filter.exr";
  lightfield::WriteMeasuredFilter(filter_file,
                                  reconstruct::MeasureFilter(photographs.sheet, photographs.light,
                                                             photographs.prints, &readings));
  const auto filter = lightfield::ReadMeasuredFilter(filter_file);
  reconstruct::ReconstructOptions how;
  how.filter = &filter;
  add("print with errors, filter as measured",
      reconstruct::Reconstruct(measured.measurements, how));
  const hal::sim::LabDescription truth =
      hal::sim::ReadLab(core::Config::FromFile(wrong), options.seed);
  const auto shift_error = filter.shift_m - truth.filter.errors.shift_m;
  rows.back()["shift_error_m"] = std::hypot(shift_error.x, shift_error.y);
  rows.back()["shift_sigma_m"] = filter.shift_sigma_m;
  rows.back()["light_ratio"] = readings.prints.front().light_ratio;
  return rows;
}

}  // namespace luxfield::bench
