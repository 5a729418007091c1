#include "study/bench_tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "core/error.h"
#include "core/measures.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/stopwatch.h"
#include "lightfield/light_vector.h"
#include "render/lit_scene.h"
#include "render/renderer.h"

namespace luxfield::study {
namespace {

using nlohmann::json;

constexpr std::uint64_t kSeed = 3, kReferenceSeed = 1000;
constexpr int kMostRuns = 3;
constexpr double kEnough_s = 1;  // of timing one setting

struct Case {
  std::string scene;
  bool shadows = false, glossy = false;
};

// Two unbiased pictures of independent samples, or twice the closed form.
struct Reference {
  core::Image a, b;
  core::Image mean;
  double rel_rmse = 0;  // standard error of the mean
};

Reference MakeReference(core::Image a, core::Image b) {
  Reference reference{std::move(a), std::move(b), {}, 0};
  reference.mean = reference.a;
  for (std::size_t i = 0; i < reference.mean.data.size(); ++i)
    reference.mean.data[i] = 0.5f * (reference.a.data[i] + reference.b.data[i]);
  reference.rel_rmse = 0.5 * core::Compare(reference.a, reference.b).rel_rmse;
  return reference;
}

// core::Compare against the mean, but with squared errors as (x - a)(x - b): the halves' own noise
// then averages out instead of adding to the error of x. What is left of it can exceed a small
// error or make it negative; an error below the reference's own cannot be told and is stated as
// that.
core::Difference Compare(const core::Image& x, const Reference& reference) {
  core::Difference difference = core::Compare(x, reference.mean);
  const double mean = difference.mean_reference, eps = 1e-4 * mean * mean;
  double squares = 0, relative = 0;
  for (std::size_t i = 0; i < x.data.size(); ++i) {
    const double square =
        (double{x.data[i]} - reference.a.data[i]) * (double{x.data[i]} - reference.b.data[i]);
    squares += square;
    const double r = reference.mean.data[i];
    if (square != 0) relative += square / (r * r + eps);
  }
  const auto count = static_cast<double>(x.data.size());
  const double rmse = std::sqrt(std::max(squares, 0.0) / count);
  difference.rel_rmse = std::max(mean > 0 ? rmse / mean : 0, reference.rel_rmse);
  difference.rel_mse = std::max(relative / count, 0.0);
  return difference;
}

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

render::RenderOptions PictureOptions(const BenchTradeoffOptions& options, const Case& c) {
  render::RenderOptions picture;
  picture.width = options.width;
  picture.height = options.height;
  picture.shadows = c.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  picture.seed = kSeed;
  return picture;
}

// The light of the closed form in double on the surfaces that the renderer sees.
Reference ClosedForm(const render::LitScene& scene, const BenchTradeoffOptions& options) {
  scene::Camera camera = scene.camera();
  camera.width = options.width;
  camera.height = options.height;
  render::GBuffer gbuffer(scene.device(), options.width, options.height);
  render::PrimaryVisibility(scene.device())
      .Render(scene.geometry(), camera, 0, {0.5, 0.5}, gbuffer)
      .Wait();
  const auto position = gbuffer.position.Download<cl_float4>();
  const auto normal = gbuffer.normal.Download<cl_float4>();
  const auto albedo = gbuffer.albedo.Download<cl_float4>();
  core::Image radiance(options.width, options.height, 3);
  core::ParallelFor(gbuffer.pixel_count(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (position[i].s[3] == 0) continue;
      std::array<double, 3> sum{};
      for (const auto& luminaire : scene.luminaires()) {
        const scene::Pose luminaire_from_world = luminaire.world_from_luminaire.Inverse();
        const auto& p = position[i].s;
        const auto& n = normal[i].s;
        const auto e = lightfield::ExactIrradiance(luminaire.light_field->field,
                                                   luminaire_from_world.Point({p[0], p[1], p[2]}),
                                                   luminaire_from_world.Vector({n[0], n[1], n[2]}));
        for (int c = 0; c < 3; ++c) sum[c] += luminaire.scale * e[c];
      }
      for (int c = 0; c < 3; ++c)
        radiance.plane(c)[i] =
            static_cast<float>(double{albedo[i].s[c]} * std::numbers::inv_pi * sum[c]);
    }
  });
  return MakeReference(radiance, radiance);
}

bool Serves(const render::EstimatorTraits& traits, const Case& c) {
  return traits.any_brdf || !c.glossy;
}

// The unbiased estimator with the least variance times time, from a pilot.
std::string ReferenceEstimator(render::LitScene& scene, const BenchTradeoffOptions& options,
                               const Case& c) {
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& traits : render::EstimatorList()) {
    if (!Serves(traits, c) || !(c.shadows ? traits.unbiased_with_shadows : traits.unbiased))
      continue;
    auto picture = PictureOptions(options, c);
    picture.estimator = traits.name;
    picture.samples_per_pixel = 256;
    picture.passes = 8;
    const render::Frame frame = render::Renderer(scene, picture).Render();
    double variance = 0;
    for (const float v : frame.variance.data) variance += v;
    if (variance * frame.times.lighting_s < least) {
      least = variance * frame.times.lighting_s;
      best = traits.name;
    }
  }
  if (best.empty())
    throw InputError(fmt::format("bench tradeoff: no estimator is unbiased for {}{} surfaces",
                                 c.glossy ? "glossy" : "diffuse", c.shadows ? " shadowed" : ""));
  return best;
}

Reference Sampled(render::LitScene& scene, const BenchTradeoffOptions& options, const Case& c) {
  auto picture = PictureOptions(options, c);
  picture.estimator = ReferenceEstimator(scene, options, c);
  picture.samples_per_pixel = options.reference_samples / 2;
  std::array<core::Image, 2> halves;
  for (int k = 0; k < 2; ++k) {
    picture.seed = kReferenceSeed + k;
    halves[k] = render::Renderer(scene, picture).Render().radiance;
  }
  return MakeReference(std::move(halves[0]), std::move(halves[1]));
}

struct Measured {
  core::Image radiance;
  double wall_s = 0, core_s = 0;
};

// The first run compiles and touches memory: it is not timed.
Measured Measure(render::LitScene& scene, const render::RenderOptions& picture) {
  render::Renderer renderer(scene, picture);
  Measured best{renderer.Render().radiance, std::numeric_limits<double>::infinity(),
                std::numeric_limits<double>::infinity()};
  double spent_s = 0;
  for (int run = 0; run < kMostRuns && spent_s < kEnough_s; ++run) {
    const auto times = renderer.Render().times;
    best.wall_s = std::min(best.wall_s, times.lighting_s);
    best.core_s = std::min(best.core_s, times.lighting_core_s);
    spent_s += times.lighting_s;
  }
  return best;
}

// Rows of one scene with one kind of surface.
class SceneBench {
 public:
  SceneBench(const render::Device& device, const scene::Scene& scene,
             const BenchTradeoffOptions& options, Case c)
      : device_(device),
        scene_(scene),
        options_(options),
        case_(std::move(c)),
        lit_(device, scene) {}

  void AddRows(json& rows) {
    const Reference reference =
        case_.shadows || case_.glossy ? Sampled(lit_, options_, case_) : ClosedForm(lit_, options_);
    for (const auto& traits : render::EstimatorList()) {
      const bool wanted = options_.estimators.empty() ||
                          std::find(options_.estimators.begin(), options_.estimators.end(),
                                    traits.name) != options_.estimators.end();
      if (!wanted || !Serves(traits, case_) || (case_.shadows && !traits.traced_shadows)) continue;
      for (const Knobs& knobs : KnobsOf(traits, case_.shadows)) {
        auto picture = PictureOptions(options_, case_);
        knobs.apply(picture);
        const bool samples = !traits.noise_free || picture.shadows == render::Shadows::kTraced;
        // A scene that holds no tables yet, so that the time of building them shows.
        render::LitScene lit(device_, scene_);
        for (const int spp : samples ? options_.samples_per_pixel : std::vector<int>{0})
          rows.push_back(Row(lit, traits, knobs, spp, reference));
      }
    }
  }

 private:
  json Row(render::LitScene& lit, const render::EstimatorTraits& traits, const Knobs& knobs,
           int spp, const Reference& reference) const {
    auto picture = PictureOptions(options_, case_);
    picture.estimator = traits.name;
    picture.samples_per_pixel = std::max(spp, 1);
    knobs.apply(picture);
    const Measured measured = Measure(lit, picture);
    const auto difference = Compare(measured.radiance, reference);
    int images = 0, channels = 1;
    for (const auto& luminaire : lit.luminaires()) {
      const auto& geometry = luminaire.light_field->field.geometry;
      images += geometry.grid.count();
      channels = std::max(channels, geometry.channels);
    }
    return {{"scene", case_.scene},
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
  Case case_;
  render::LitScene lit_;
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
  core::Progress progress("bench tradeoff", 4 * scenes.size());
  for (const scene::Scene& scene : scenes) {
    scene::Scene diffuse = scene;
    scene::MakeLambertian(diffuse.geometry);
    const auto& materials = scene.geometry.materials;
    const bool is_glossy = std::any_of(materials.begin(), materials.end(), scene::IsGlossy);
    for (const bool shadows : {false, true})
      for (const bool glossy : {false, true}) {
        if (!glossy || is_glossy)
          SceneBench(device, glossy ? scene : diffuse, options,
                     {scene.file.stem().string(), shadows, glossy})
              .AddRows(rows);
        progress.Advance();
      }
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

}  // namespace luxfield::study
