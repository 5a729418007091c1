#include "luxfield/bench/bench_noise.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "luxfield/bench/ball_scene.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/progress.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

using render::RenderOptions;
using scene::Scene;

constexpr double kAlike = 1e-9;  // noise of pictures that no random number changes: rounding

// A beam with stripes.
lightfield::LightField Lamp() {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.1;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 4, 3, 0.02);
  geometry.lattice = {32, 32, -0.16, 0.16, 0.01, 0.01};
  lightfield::LightField field(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < 32; ++column) {
        const auto s = geometry.lattice.centre(row, column);
        field.image(m, 0)[static_cast<std::size_t>(row) * 32 + column] = static_cast<float>(
            (1 + m) * std::exp(-40 * (s.x * s.x + s.y * s.y)) * (1 + 0.9 * std::cos(120 * s.x)));
      }
  return field;
}

// Brighter towards one side, with a small sun.
core::Image Sky() {
  core::Image picture(64, 32, 3);
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 64; ++column)
      for (int c = 0; c < 3; ++c)
        picture.at(c, row, column) = 1 + 0.01f * static_cast<float>(column) +
                                     (std::hypot(column - 40, row - 6) < 2 ? 100.0f : 0.0f);
  return picture;
}

// Removed with what is in it.
struct Files {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-noise-{}", ::getpid());
  std::filesystem::path lamp = folder / "lamp.lf.exr", sky = folder / "sky.exr";

  Files() {
    std::filesystem::create_directories(folder);
    lightfield::WriteLightField(lamp, Lamp());
    core::WriteExrImage(sky, Sky());
  }
  ~Files() {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;
};

struct Case {
  std::string name;
  bool lamp = false, sky = false, area = false, glossy = false;
  RenderOptions options;
};

class Cases {
 public:
  std::vector<Case> all;

  Cases() {
    for (const bool traced : {false, true}) {
      const auto shadows = traced ? render::Shadows::kTraced : render::Shadows::kNone;
      for (const bool glossy : {false, true}) {
        for (const auto& traits : render::EstimatorList()) {
          if (traits.noise_free && (!traced || (glossy && !traits.any_brdf))) continue;
          Lamp(traits.name, shadows, glossy, {});
        }
        for (const char* sets : {"scrambled", "interleaved", "shared"})
          Sky(shadows, glossy, {"environment-sets=" + std::string(sets)});
        Sky(shadows, glossy, {"environment-tiles=4", "environment-balance=energy"});
        Sky(shadows, glossy, {"strategies-for=all", "strategies=newton"});
        for (const char* strategies : {"lobe", "balance", "newton"})
          Area(shadows, glossy, {"strategies=" + std::string(strategies)});
      }
    }
    for (const char* sequence : {"halton", "sobol", "mersenne"})
      for (const char* correlation : {"shared", "decorrelated"})
        Lamp("thesis", render::Shadows::kNone, false,
             {"sequence=" + std::string(sequence), "correlation=" + std::string(correlation),
              "allocation=systematic"});
    Case everything = Add("lamp, sky and area lights", render::Shadows::kTraced, true, {});
    everything.lamp = everything.sky = everything.area = true;
    everything.options.antialias = 4;
    all.push_back(everything);
    everything.name += ", two strategies";
    everything.options.knobs.Set("strategies-for=all");
    all.push_back(everything);
    Case dealt = Add("lamp, windowed, dealt out", render::Shadows::kNone, false, {});
    dealt.lamp = true;
    dealt.options.estimator = "windowed";
    dealt.options.sample_density = core::Image(4, 1, 1);
    dealt.options.sample_density.data = {0.5f, 1, 4, 0.25f};
    all.push_back(dealt);
  }

 private:
  static Case Add(const std::string& name, render::Shadows shadows, bool glossy,
                  const std::vector<std::string>& knobs) {
    Case c;
    c.name = name;
    for (const auto& knob : knobs) {
      c.options.knobs.Set(knob);
      c.name += ", " + knob;
    }
    c.name += glossy ? ", glossy" : "";
    c.name += shadows == render::Shadows::kTraced ? ", traced" : "";
    c.glossy = glossy;
    c.options.shadows = shadows;
    return c;
  }
  void Lamp(const std::string& estimator, render::Shadows shadows, bool glossy,
            const std::vector<std::string>& knobs) {
    all.push_back(Add("lamp, " + estimator, shadows, glossy, knobs));
    all.back().lamp = true;
    all.back().options.estimator = estimator;
  }
  void Sky(render::Shadows shadows, bool glossy, const std::vector<std::string>& knobs) {
    all.push_back(Add("sky", shadows, glossy, knobs));
    all.back().sky = true;
  }
  void Area(render::Shadows shadows, bool glossy, const std::vector<std::string>& knobs) {
    all.push_back(Add("area lights", shadows, glossy, knobs));
    all.back().area = true;
  }
};

Scene SceneOf(const Case& c, const Files& files, int width, int height) {
  Scene scene = BallScene(width, height);
  if (!c.glossy) scene::MakeLambertian(scene.geometry);
  if (c.lamp)
    scene.luminaires.push_back(
        {"lamp", files.lamp, {}, scene::LookAt({-0.8, -2, 1.4}, {0.1, 0, 0.3}, {0, 0, 1}), 200});
  if (c.sky) {
    scene.environment.emplace();
    scene.environment->file = files.sky;
    scene.environment->face_size = 16;
    scene.environment->world_from_environment = scene::RotationXyz({90, 0, 0});
  }
  if (c.area) {
    scene::AreaLight rectangle, sphere;
    rectangle.radiance = {6, 6, 6};
    rectangle.width_m = 0.8;
    rectangle.height_m = 0.5;
    rectangle.world_from_light = scene::LookAt({-0.5, -0.4, 2}, {0, 0, 0.3}, {0, 1, 0});
    sphere.kind = scene::AreaLightKind::kSphere;
    sphere.radiance = {20, 20, 20};
    sphere.radius_m = 0.1;
    sphere.world_from_light = scene::Translation({1.5, -1.5, 1.5});
    scene.area_lights = {rectangle, sphere};
  }
  return scene;
}

double SumOf(const core::Image& image) {
  double sum = 0;
  for (const float x : image.data) sum += x;
  return sum;
}

// Of one number per picture.
struct Moments {
  double sum = 0, squares = 0;
  int count = 0;

  void Add(double x) { sum += x, squares += x * x, ++count; }
  double Mean() const { return sum / count; }
  double Variance() const {
    return std::max(0.0, (squares - sum * sum / count) / std::max(1, count - 1));
  }
  // Relative standard error of the mean.
  double RelativeError() const { return sum > 0 ? std::sqrt(Variance() / count) / Mean() : 0; }
};

// The pictures of all seeds, summed over pixels.
struct Pictures {
  std::vector<core::Image> luminance;
  Moments estimated, stated, root, sigma;  // variances; the root of the first and what it says

  void Add(const render::Frame& frame, int degrees) {
    luminance.push_back(core::LuminanceImage(frame.radiance));
    const double variance = SumOf(frame.variance);
    estimated.Add(variance);
    stated.Add(SumOf(frame.stated_variance));
    root.Add(std::sqrt(variance));
    sigma.Add(render::NoiseOf(frame, degrees).Sigma());
  }
  double MeanLuminance() const {
    double sum = 0;
    for (const core::Image& image : luminance) sum += SumOf(image);
    return sum / static_cast<double>(luminance.size() * luminance.front().data.size());
  }
  // Squared deviations from the mean over all pictures, picture by picture, of the expectation
  // that the variances have.
  Moments Spread() const {
    const auto count = static_cast<double>(luminance.size());
    std::vector<double> mean(luminance.front().data.size(), 0.0);
    for (const core::Image& image : luminance)
      for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += image.data[i] / count;
    Moments spread;
    for (const core::Image& image : luminance) {
      double squares = 0;
      for (std::size_t i = 0; i < mean.size(); ++i)
        squares += (image.data[i] - mean[i]) * (image.data[i] - mean[i]);
      spread.Add(squares * count / (count - 1));
    }
    return spread;
  }
};

Pictures Render(render::LitScene& scene, const RenderOptions& options, std::uint64_t first_seed,
                int seeds) {
  Pictures pictures;
  RenderOptions picture = options;
  for (int k = 0; k < seeds; ++k) {
    picture.seed = first_seed + k;
    pictures.Add(render::Renderer(scene, picture).Render(),
                 std::max(1, picture.samples_per_pixel - 1));
  }
  return pictures;
}

nlohmann::json Row(const Case& c, render::LitScene& scene, const BenchNoiseOptions& how) {
  RenderOptions options = c.options;
  const int lights = static_cast<int>(scene.luminaires().size() + scene.area_lights().size()) +
                     (scene.environment() ? 1 : 0);
  options.samples_per_pixel = how.samples_per_pixel * lights * options.antialias;
  const Pictures pictures = Render(scene, options, how.seed, how.seeds);
  // An eighth of the seeds shows what passes lose.
  options.passes = 4;
  const Pictures split = Render(scene, options, how.seed, std::max(2, how.seeds / 8));
  const Moments spread = pictures.Spread();
  const auto rms = [&](const Moments& m) {
    return std::sqrt(m.Mean() / static_cast<double>(how.width * how.height)) /
           pictures.MeanLuminance();
  };
  const bool alike = rms(spread) < kAlike;
  const auto over_spread = [&](const Moments& m) {
    return alike ? 0 : std::sqrt(m.Mean() / spread.Mean());
  };
  const double ratio = over_spread(pictures.estimated);
  return {{"case", c.name},
          {"spp", options.samples_per_pixel},
          {"noise", rms(spread)},
          {"estimate", rms(pictures.estimated)},
          {"ratio", ratio},
          {"ratio_se",
           0.5 * ratio * std::hypot(spread.RelativeError(), pictures.estimated.RelativeError())},
          {"as_independent", over_spread(pictures.stated)},
          {"four_passes", over_spread(split.Spread())},
          {"scatter",
           pictures.root.sum > 0 ? std::sqrt(pictures.root.Variance()) / pictures.root.Mean() : 0},
          {"sigma", pictures.sigma.Mean()}};
}

}  // namespace

nlohmann::json BenchNoise(const BenchNoiseOptions& options) {
  if (options.seeds < 2 || std::min({options.width, options.height, options.samples_per_pixel}) < 1)
    throw InputError(
        "bench noise: at least two seeds, one pixel and one sample are needed to see a scatter");
  const auto device = render::Device::Open(options.device, options.threads);
  const Files files;
  const Cases cases;
  const auto is_wanted = [&](const Case& c) {
    return options.cases.empty() ||
           std::any_of(options.cases.begin(), options.cases.end(),
                       [&](const std::string& start) { return c.name.starts_with(start); });
  };
  nlohmann::json rows = nlohmann::json::array();
  core::Progress progress("cases", cases.all.size());
  for (const Case& c : cases.all) {
    progress.Advance(1, c.name);
    if (!is_wanted(c)) continue;
    render::LitScene scene(device, SceneOf(c, files, options.width, options.height));
    rows.push_back(Row(c, scene, options));
  }
  return rows;
}

}  // namespace luxfield::bench
