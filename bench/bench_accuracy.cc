#include "luxfield/bench/bench_accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "luxfield/bench/scene_cases.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/planning/reference_picture.h"
#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

constexpr int kSweep[] = {4, 16, 64, 256, 1024};
// Pictures of a setting whose errors' RMS counts: a lucky draw is not a setting that gets there.
constexpr int kSweepSeeds = 4;
constexpr double kResolved = 0.2;

// The lamps' own tables serve any picture: they are no part of a picture's time, as those of
// volumes are, which are made for what the camera sees.
render::LitScene WithLampTables(const render::Device& device, const scene::Scene& scene) {
  render::LitScene lit(device, scene);
  lit.Require({.sat = true, .cells = true});
  return lit;
}

struct Fixed {
  std::string estimator;
  double samples = 0, core_s = std::numeric_limits<double>::infinity();
};

struct Series {
  std::string estimator;
  std::vector<double> spp, errors, core_s;
};

// Where the series' error falls to the target: log-log between neighbouring points, by the last two
// beyond them.
std::optional<Fixed> CheapestWithin(const Series& series, double target) {
  const auto& [estimator, spp, errors, core_s] = series;
  if (errors.front() <= target) return Fixed{estimator, spp.front(), core_s.front()};
  for (std::size_t k = 1; k < errors.size(); ++k) {
    if (errors[k] > target && k + 1 < errors.size()) continue;
    const double slope = std::log(errors[k] / errors[k - 1]) / std::log(spp[k] / spp[k - 1]);
    if (!(slope < 0)) continue;
    const double samples = spp[k - 1] * std::pow(target / errors[k - 1], 1 / slope);
    const double per_sample_s = (core_s[k] - core_s[k - 1]) / (spp[k] - spp[k - 1]);
    return Fixed{estimator, samples,
                 core_s[k - 1] + std::max(0.0, per_sample_s) * (samples - spp[k - 1])};
  }
  return std::nullopt;
}

// Every estimator's errors and times over the sample counts, up to the time of the best so far that
// reaches the least target.
class Sweep {
 public:
  Sweep(render::LitScene lit, const render::RenderOptions& picture,
        const planning::ReferencePicture& reference, double least_target) {
    const bool shadows = picture.shadows != render::Shadows::kNone;
    for (const auto& traits : render::EstimatorList()) {
      if (!render::StatesItsError(traits, lit.geometry().glossy, shadows)) continue;
      render::RenderOptions options = picture;
      options.estimator = traits.name;
      const double tables_before_s = lit.tables_core_s();
      render::Renderer(lit, options).Render();  // compiles and builds
      const double tables_s = lit.tables_core_s() - tables_before_s;
      Series series{traits.name, {}, {}, {}};
      for (const int samples : kSweep) {
        options.samples_per_pixel = samples;
        double core_s = std::numeric_limits<double>::infinity(), squares = 0;
        for (int k = 0; k < kSweepSeeds; ++k) {
          options.seed = picture.seed + kSweepSeeds + static_cast<std::uint64_t>(k);
          const auto frame = render::Renderer(lit, options).Render();
          core_s = std::min(core_s, frame.times.lighting_core_s);
          squares += std::pow(
              planning::Compare(core::LuminanceImage(frame.radiance), reference).rel_rmse, 2);
        }
        series.spp.push_back(samples);
        series.core_s.push_back(tables_s + core_s);
        series.errors.push_back(std::sqrt(squares / kSweepSeeds));
        if (!render::TakesSamples(traits, shadows) ||
            series.core_s.back() > Best(least_target).core_s)
          break;
      }
      series_.push_back(std::move(series));
    }
  }

  Fixed Best(double target) const {
    Fixed best;
    for (const auto& series : series_) {
      const auto fixed = CheapestWithin(series, target);
      if (fixed && fixed->core_s < best.core_s) best = *fixed;
    }
    return best;
  }

 private:
  std::vector<Series> series_;
};

void AddRows(const render::Device& device, const render::CostModel& costs,
             const BenchAccuracyOptions& options, const scene::Scene& scene, const SceneCase& c,
             json& rows) {
  render::AccuracyRequest request;
  request.picture.shadows = c.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  request.picture.width = options.width;
  request.picture.height = options.height;
  const auto& targets = c.shadows ? options.shadowed_targets : options.targets;
  const double least = *std::min_element(targets.begin(), targets.end());
  render::LitScene lit = WithLampTables(device, scene);
  const planning::ReferencePicture reference = planning::LuminanceOf(planning::RenderReference(
      lit, request.picture, options.reference_samples, kResolved * least));
  const Sweep sweep(WithLampTables(device, scene), request.picture, reference, least);
  for (const double target : targets) {
    const Fixed best = sweep.Best(target);
    for (int k = 0; k < options.seeds; ++k) {
      request.rel_error = target;
      request.picture.seed = options.seed + static_cast<std::uint64_t>(k);
      lit.DropVolumes();
      const double tables_before_s = lit.tables_core_s();
      const auto result = render::RenderToAccuracy(lit, costs, request);
      const auto& times = result.frame.times;
      const double error =
          planning::Compare(core::LuminanceImage(result.frame.radiance), reference).rel_rmse;
      const bool has_volume = lit.EstimatorNamed(result.chosen.estimator).traits().needs.volume;
      const double core_s =
          times.lighting_core_s + (has_volume ? lit.tables_core_s() - tables_before_s : 0);
      const bool found = std::isfinite(best.core_s);
      rows.push_back({{"scene", scene.file.stem().string()},
                      {"shadows", c.shadows ? "on" : "off"},
                      {"surface", c.glossy ? "glossy" : "diffuse"},
                      {"asked", target},
                      {"seed", request.picture.seed},
                      {"estimated", result.estimated_error},
                      {"true", error},
                      {"kept", error <= target},
                      {"resolved", reference.rel_rmse <= kResolved * target},
                      {"met", result.met},
                      {"estimator", result.chosen.estimator},
                      {"spp", result.chosen.samples_per_pixel},
                      {"core_s", core_s},
                      {"lighting_s", times.lighting_s},
                      {"choosing_s", result.choosing_s},
                      {"best_fixed", best.estimator},
                      {"best_fixed_spp", best.samples},
                      {"best_fixed_core_s", found ? json(best.core_s) : json()},
                      {"time_ratio", found ? json(core_s / best.core_s) : json()},
                      {"reference_error", reference.rel_rmse}});
    }
  }
}

}  // namespace

json BenchAccuracy(const BenchAccuracyOptions& options) {
  if (options.scenes.empty() || options.targets.empty() || options.shadowed_targets.empty() ||
      options.seeds < 1)
    throw InputError("bench accuracy: give at least one scene, one target and one seed");
  const auto device = render::Device::Open(options.device, options.threads);
  std::vector<scene::Scene> scenes;
  std::size_t cases = 0;
  for (const auto& path : options.scenes) {
    scenes.push_back(scene::ReadScene(path));
    cases += CasesOf(scenes.back()).size();
  }
  core::Progress progress("bench accuracy", cases);
  const render::CostModel costs = options.costs ? *options.costs : render::Calibrate(device);
  json rows = json::array();
  for (const scene::Scene& scene : scenes)
    for (const SceneCase& c : CasesOf(scene)) {
      AddRows(device, costs, options, SceneOf(scene, c), c, rows);
      progress.Advance();
    }
  return rows;
}

json AccuracySummary(const json& rows) {
  int resolved = 0, kept = 0;
  std::vector<double> ratios;
  for (const auto& row : rows) {
    resolved += row.at("resolved").get<bool>();
    kept += row.at("resolved").get<bool>() && row.at("kept").get<bool>();
    if (!row.at("time_ratio").is_null()) ratios.push_back(row.at("time_ratio"));
  }
  std::sort(ratios.begin(), ratios.end());
  return {{"resolved", resolved},
          {"kept", kept},
          {"unresolved", static_cast<int>(rows.size()) - resolved},
          {"timed", ratios.size()},
          {"within_twice_the_time",
           std::upper_bound(ratios.begin(), ratios.end(), 2.0) - ratios.begin()},
          {"median_time_ratio", ratios.empty() ? 0 : ratios[ratios.size() / 2]},
          {"worst_time_ratio", ratios.empty() ? 0 : ratios.back()}};
}

}  // namespace luxfield::bench
