#include "luxfield/bench/bench_tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "luxfield/bench/scene_cases.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/planning/reference_picture.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

constexpr std::uint64_t kSeed = 3;
constexpr int kMostRuns = 3;
constexpr double kEnough_s = 1;  // of timing one setting

// A value of an estimator's knobs; the samples come on top.
struct Knobs {
  std::string text;  // "" for the defaults
  std::function<void(render::RenderOptions&)> apply = [](render::RenderOptions&) {};
};

// What is worth trying besides the defaults.
std::vector<Knobs> KnobsOf(const render::EstimatorTraits& traits, bool shadows) {
  std::vector<Knobs> knobs(1);
  if (shadows && traits.map_shadows)
    for (const auto maps : {render::Shadows::kMaps, render::Shadows::kThesisMaps})
      knobs.push_back({"shadows=" + render::ShadowsName(maps),
                       [maps](render::RenderOptions& o) { o.shadows = maps; }});
  if (traits.name == "thesis" || traits.name == "windowed")
    knobs.push_back({"k_max=7", [](render::RenderOptions& o) { o.max_samples_per_image = 7; }});
  if (traits.error_is_asked && !shadows)  // their noise hides it
    for (const double error : {1e-2, 5e-4})
      knobs.push_back({fmt::format("approximation_error={}", error),
                       [error](render::RenderOptions& o) { o.approximation_error = error; }});
  const auto add = [&](const std::string& text) {
    knobs.push_back({text, [text](render::RenderOptions& o) {
                       std::istringstream words(text);
                       for (std::string word; words >> word;) o.knobs.Set(word);
                     }});
  };
  if (traits.name == "windowed") {
    add("basis-share=0");
    add("basis-share=0.9");
    add("brdf-share=0");
  }
  if (traits.name == "thesis") {
    add("allocation=systematic correlation=decorrelated sequence=sobol");
    add("inversion=bisection depth=3");
    add("inversion=secant depth=3");
    add("sequence=mersenne");
  }
  return knobs;
}

render::RenderOptions PictureOptions(const BenchTradeoffOptions& options, const SceneCase& c) {
  render::RenderOptions picture;
  picture.width = options.width;
  picture.height = options.height;
  picture.shadows = c.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  picture.seed = kSeed;
  return picture;
}

bool Serves(const render::EstimatorTraits& traits, const SceneCase& c) {
  return traits.any_brdf || !c.glossy;
}

struct Measured {
  core::Image radiance;
  double wall_s = 0, core_s = 0;
};

// Of a scene that has lit such a picture before: nothing is left to compile.
Measured Measure(render::LitScene& scene, const render::RenderOptions& picture) {
  render::Renderer renderer(scene, picture);
  Measured best{
      {}, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  double spent_s = 0;
  for (int run = 0; run < kMostRuns && spent_s < kEnough_s; ++run) {
    auto frame = renderer.Render();
    best.radiance = std::move(frame.radiance);
    best.wall_s = std::min(best.wall_s, frame.times.lighting_s);
    best.core_s = std::min(best.core_s, frame.times.lighting_core_s);
    spent_s += frame.times.lighting_s;
  }
  return best;
}

// Rows of one scene with one kind of surface.
class SceneBench {
 public:
  SceneBench(const render::Device& device, const scene::Scene& scene,
             const BenchTradeoffOptions& options, SceneCase c)
      : device_(device), scene_(scene), options_(options), case_(c) {}

  void AddRows(json& rows) {
    render::LitScene judged(device_, scene_);
    const planning::ReferencePicture reference = planning::RenderReference(
        judged, PictureOptions(options_, case_), options_.reference_samples);
    for (const auto& traits : render::EstimatorList()) {
      const bool wanted = options_.estimators.empty() ||
                          std::find(options_.estimators.begin(), options_.estimators.end(),
                                    traits.name) != options_.estimators.end();
      if (!wanted || !Serves(traits, case_) || (case_.shadows && !traits.traced_shadows)) continue;
      std::optional<render::LitScene> lit;
      for (const Knobs& knobs : KnobsOf(traits, case_.shadows)) {
        auto picture = PictureOptions(options_, case_);
        knobs.apply(picture);
        const bool samples = !traits.noise_free || picture.shadows == render::Shadows::kTraced;
        // A scene that holds none of the tables that depend on it, so that the time of building
        // them shows.
        if (!lit || traits.error_is_asked) lit.emplace(device_, scene_);
        picture.estimator = traits.name;
        picture.samples_per_pixel = 1;
        render::Renderer(*lit, picture).Render();  // compiles and builds tables
        for (const int spp : samples ? options_.samples_per_pixel : std::vector<int>{0})
          rows.push_back(Row(*lit, traits, knobs, spp, reference));
      }
    }
  }

 private:
  json Row(render::LitScene& lit, const render::EstimatorTraits& traits, const Knobs& knobs,
           int spp, const planning::ReferencePicture& reference) const {
    auto picture = PictureOptions(options_, case_);
    picture.estimator = traits.name;
    picture.samples_per_pixel = std::max(spp, 1);
    knobs.apply(picture);
    const Measured measured = Measure(lit, picture);
    const auto difference = planning::Compare(measured.radiance, reference);
    int images = 0, channels = 1;
    for (const auto& luminaire : lit.luminaires()) {
      const auto& geometry = luminaire.light_field->geometry();
      images += geometry.grid.count();
      channels = std::max(channels, geometry.channels);
    }
    return {{"scene", scene_.file.stem().string()},
            {"shadows", case_.shadows ? "on" : "off"},
            {"surface", case_.glossy ? "glossy" : "diffuse"},
            {"estimator", traits.name},
            {"spp", spp},
            {"knobs", knobs.text},
            {"width", options_.width},
            {"height", options_.height},
            {"images", images},
            {"channels", channels},
            {"threads", device_.info().compute_units},
            {"build_core_s", lit.tables_core_s()},
            {"fps", 1 / measured.wall_s},
            {"core_s", measured.core_s},
            {"rel_rmse", difference.rel_rmse},
            {"rel_mse", difference.rel_mse},
            {"mean_lab", difference.mean_lab},
            {"bias", difference.bias},
            {"reference_rel_rmse", reference.rel_rmse},
            {"resolved", difference.rel_rmse >= 10 * reference.rel_rmse}};
  }

  const render::Device& device_;
  const scene::Scene& scene_;
  const BenchTradeoffOptions& options_;
  SceneCase case_;
};

void Check(const BenchTradeoffOptions& options) {
  if (options.scenes.empty() || options.samples_per_pixel.empty() ||
      std::min({options.width, options.height}) < 1 || options.reference_samples < 2)
    throw InputError(
        "bench tradeoff: give at least one scene and one number of samples, a picture of at least "
        "one pixel and two reference samples");
  const auto list = render::EstimatorList();
  for (const auto& name : options.estimators)
    if (std::none_of(list.begin(), list.end(), [&](const auto& t) { return t.name == name; }))
      throw InputError(fmt::format("bench tradeoff: there is no estimator '{}'", name));
}

void CheckLamps(const scene::Scene& scene) {
  for (const auto& luminaire : scene.luminaires)
    if (!std::filesystem::exists(luminaire.light_field))
      throw InputError(scene.file.string(),
                       fmt::format("its lamp {} is not there", luminaire.light_field.string()),
                       "make the lamps first: ./run lamps");
}

}  // namespace

json BenchTradeoff(const BenchTradeoffOptions& options) {
  Check(options);
  const auto device = render::Device::Open(options.device, options.threads);
  std::vector<scene::Scene> scenes;
  for (const auto& file : options.scenes) {
    scenes.push_back(scene::ReadScene(file));
    CheckLamps(scenes.back());
  }
  json rows = json::array();
  std::size_t cases = 0;
  for (const scene::Scene& scene : scenes) cases += CasesOf(scene).size();
  core::Progress progress("bench tradeoff", cases);
  for (const scene::Scene& scene : scenes)
    for (const SceneCase& c : CasesOf(scene)) {
      const scene::Scene lit = SceneOf(scene, c);
      SceneBench(device, lit, options, c).AddRows(rows);
      progress.Advance();
    }
  MarkPareto(rows);
  return rows;
}

void MarkPareto(json& rows) {
  const auto group = [](const json& row) {
    return std::array{row.at("scene").get<std::string>(), row.at("shadows").get<std::string>(),
                      row.at("surface").get<std::string>()};
  };
  for (auto& row : rows) {
    const double time = row.at("core_s"), error = row.at("rel_rmse");
    row["pareto"] = std::none_of(rows.begin(), rows.end(), [&](const json& other) {
      const double other_time = other.at("core_s"), other_error = other.at("rel_rmse");
      return group(other) == group(row) && other_time <= time && other_error <= error &&
             (other_time < time || other_error < error);
    });
  }
}

}  // namespace luxfield::bench
