#include "luxfield/bench/bench_lamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

using scene::Vec3;

constexpr double kSquare_m = 20, kLampHeight_m = 30;
constexpr int kBoxes = 60;

scene::Scene Square(const BenchLampsOptions& options, int lamps,
                    const std::filesystem::path& field) {
  scene::Scene scene;
  scene.geometry.materials.emplace_back();
  scene::AppendQuad({0, 0, 0}, {kSquare_m, 0, 0}, {0, kSquare_m, 0}, 0, scene.geometry);
  core::Random random(4, 0);
  for (int k = 0; k < kBoxes; ++k) {
    const double height = 0.5 + 2 * random.Uniform();
    const Vec3 at{kSquare_m * random.Uniform(), kSquare_m * random.Uniform(), height / 2};
    scene::AppendBox(scene::Translation(at) * scene::RotationXyz({0, 0, 90 * random.Uniform()}) *
                         scene::Scaling({0.5 + random.Uniform(), 0.5 + random.Uniform(), height}),
                     0, scene.geometry);
  }
  scene.camera =
      scene::Camera::LookAt({-4, -4, 9}, {9, 9, 0}, {0, 0, 1}, 40, options.width, options.height);
  const int side = static_cast<int>(std::ceil(std::sqrt(lamps)));
  for (int k = 0; k < lamps; ++k) {
    scene::Luminaire luminaire;
    luminaire.name = fmt::format("lamp {}", k + 1);
    luminaire.light_field = field;
    luminaire.world_from_luminaire = scene::Pose{
        scene::RotationXyz({180, 0, 0}).linear,
        {(k % side + 0.5) * kSquare_m / side, (k / side + 0.5) * kSquare_m / side, kLampHeight_m}};
    scene.luminaires.push_back(luminaire);
  }
  return scene;
}

// Of two pictures of different seeds, one's variance over the squared mean.
double RelativeVariance(const core::Image& a, const core::Image& b) {
  const core::Image ya = core::LuminanceImage(a), yb = core::LuminanceImage(b);
  double square = 0, sum = 0;
  for (std::size_t k = 0; k < ya.data.size(); ++k) {
    square += std::pow(double{ya.data[k]} - yb.data[k], 2) / 2;
    sum += 0.5 * (double{ya.data[k]} + yb.data[k]);
  }
  const auto pixels = static_cast<double>(ya.data.size());
  return square / pixels / std::pow(sum / pixels, 2);
}

LampsFigures Measure(const render::Device& device, const BenchLampsOptions& options, int lamps,
                     const std::filesystem::path& field) {
  render::LitScene lit(device, Square(options, lamps, field));
  render::RenderOptions how;
  how.samples_per_pixel = options.samples_per_pixel;
  how.relight = false;
  how.shadows = options.shadows ? render::Shadows::kTraced : render::Shadows::kNone;
  LampsFigures figures;
  figures.lamps = lamps;
  core::Image before;
  for (int run = -1; run < options.runs; ++run) {
    how.seed = static_cast<std::uint64_t>(run + 2);
    // The first picture compiles; a small one does.
    how.width = run < 0 ? 16 : 0;
    how.height = run < 0 ? 12 : 0;
    render::Renderer renderer(lit, how);
    device.Finish();
    const core::Stopwatch stopwatch;
    const render::Frame frame = renderer.Render();
    if (run < 0) continue;
    figures.core_s.push_back(stopwatch.CoreSeconds());
    if (run > 0)
      figures.relative_variance += RelativeVariance(before, frame.radiance) / (options.runs - 1);
    before = frame.radiance;
    double samples = 0, hit = 0;
    for (std::size_t k = 0; k < frame.samples.data.size(); ++k) {
      samples += frame.samples.data[k];
      hit += frame.coverage.data[k];
    }
    figures.samples_per_pixel = samples / std::max(1.0, hit);
  }
  return figures;
}

}  // namespace

std::vector<LampsFigures> BenchLamps(const BenchLampsOptions& options) {
  if (std::min({options.width, options.height, options.samples_per_pixel}) < 1 ||
      options.runs < 2 || std::ranges::min(options.lamps) < 1)
    throw InputError(
        "bench lamps: lamps, width, height and samples must be at least 1, the runs 2");
  const auto device = render::Device::Open(options.device, options.threads);
  const auto file = options.folder / "lamp.lf.exr";
  std::filesystem::create_directories(options.folder);
  lightfield::WriteLightField(file, render::SyntheticCar2({5, 5, 128, 1}));
  std::vector<LampsFigures> all;
  for (const int lamps : options.lamps) all.push_back(Measure(device, options, lamps, file));
  return all;
}

double CostOf(const LampsFigures& figures) { return core::Median(figures.core_s); }

double CostAtEqualError(const LampsFigures& figures) {
  return CostOf(figures) * figures.relative_variance;
}

double ExponentOf(const std::vector<LampsFigures>& all, double (*cost)(const LampsFigures&)) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto n = static_cast<double>(all.size());
  for (const LampsFigures& figures : all) {
    const double lamps = std::log(figures.lamps), c = std::log(cost(figures));
    x += lamps / n;
    y += c / n;
    xx += lamps * lamps / n;
    xy += lamps * c / n;
  }
  return (xy - x * y) / (xx - x * x);
}

}  // namespace luxfield::bench
