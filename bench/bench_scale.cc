#include "luxfield/bench/bench_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "luxfield/bench/hill_mesh.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::bench {
namespace {

constexpr int kGrid = 5, kSize = 128;
constexpr double kMegapixels = 0.05;
constexpr int kMostRuns = 3;
constexpr double kEnough_s = 2;  // of timing one size

struct Case {
  std::string what;
  double size;
  int grid, texels;
  double megapixels;
};

std::vector<Case> Cases(const BenchScaleOptions& options) {
  std::vector<Case> cases;
  for (const int grid : options.grids)
    cases.push_back({"images", static_cast<double>(grid) * grid, grid, kSize, kMegapixels});
  for (const int size : options.sizes)
    cases.push_back({"resolution", static_cast<double>(size), kGrid, size, kMegapixels});
  for (const double megapixels : options.megapixels)
    cases.push_back({"receivers", megapixels, kGrid, kSize, megapixels});
  return cases;
}

// The least wall and core-seconds of some runs of `work`, each after `prepare`.
template <typename Prepare, typename Work>
std::pair<double, double> LeastSeconds(const Prepare& prepare, const Work& work) {
  double wall_s = std::numeric_limits<double>::infinity(), core_s = wall_s, spent_s = 0;
  for (int run = 0; run < kMostRuns && spent_s < kEnough_s; ++run) {
    prepare();
    const core::Stopwatch stopwatch;
    work();
    wall_s = std::min(wall_s, stopwatch.WallSeconds());
    core_s = std::min(core_s, stopwatch.CoreSeconds());
    spent_s += stopwatch.WallSeconds();
  }
  return {wall_s, core_s};
}

nlohmann::json Measure(const render::Device& device, const Case& c, const std::string& name,
                       int samples_per_pixel) {
  core::TakePeakMib();
  const auto estimator = render::MakeEstimator(name, device);
  const auto& traits = estimator->traits();
  const int width = static_cast<int>(std::lround(std::sqrt(c.megapixels * 1e6 * 4 / 3)));
  const auto gbuffer = render::RoadGBuffer(device, width, std::max(1, width * 3 / 4));
  const auto field = render::SyntheticCar2({c.grid, c.grid, c.texels, 1});
  const render::LampTables tables = render::BuildLampTables(field, gbuffer, traits.needs);
  const render::LuminaireOnDevice luminaire(device, field, tables.view());
  render::Lighting lighting(device, gbuffer);
  render::EstimatorOptions options;
  options.samples_per_pixel = samples_per_pixel;
  const auto light = [&](const render::GBuffer& receivers, render::Lighting& sum) {
    estimator->Light({receivers}, render::PosedLuminaire{luminaire}, options, sum);
    device.Finish();
  };
  const auto few = render::RoadGBuffer(device, 16, 12);
  render::Lighting warm_up(device, few);
  light(few, warm_up);  // compiles
  const auto [wall_s, core_s] = LeastSeconds(
      [&] {
        lighting.Clear();
        device.Finish();
      },
      [&] { light(gbuffer, lighting); });
  return {{"what", c.what},
          {"estimator", name},
          {"size", c.size},
          {"wall_s", wall_s},
          {"core_s", core_s},
          {"build_core_s", tables.core_s},
          {"peak_mib", core::TakePeakMib()}};
}

nlohmann::json MeasureTriangles(const render::Device& device, int triangles) {
  constexpr int kWidth = 1024, kHeight = 768;
  render::PrimaryVisibility primary(device);
  render::GBuffer gbuffer(device, kWidth, kHeight), few(device, 16, 16);
  scene::Geometry hills = HillMesh(triangles);
  core::TakePeakMib();
  const core::Stopwatch stopwatch;
  const render::DeviceScene scene = render::UploadScene(device, std::move(hills));
  device.Finish();
  const double build_core_s = stopwatch.CoreSeconds();
  primary.Render(scene, HillCamera(16, 16), 0, {0.5, 0.5}, few).Wait();  // compiles
  const auto [wall_s, core_s] = LeastSeconds(
      [] {},
      [&] {
        primary.Render(scene, HillCamera(kWidth, kHeight), 0, {0.5, 0.5}, gbuffer).Wait();
      });
  return {{"what", "triangles"},
          {"estimator", "rays"},
          {"size", triangles},
          {"wall_s", wall_s},
          {"core_s", core_s},
          {"build_core_s", build_core_s},
          {"peak_mib", core::TakePeakMib()}};
}

double Slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double a = std::log(x[k]), b = std::log(y[k]);
    sx += a;
    sy += b;
    sxx += a * a;
    sxy += a * b;
  }
  const double spread = sxx - sx * sx / n;
  return spread > 0 ? (sxy - sx * sy / n) / spread : 0;
}

}  // namespace

nlohmann::json BenchScale(const BenchScaleOptions& options) {
  const auto device = render::Device::Open(options.device, options.threads);
  const std::vector<Case> cases = Cases(options);
  const auto list = render::EstimatorList();
  core::Progress progress("bench scale", cases.size() * list.size() + options.triangles.size());
  nlohmann::json rows = nlohmann::json::array();
  for (const int triangles : options.triangles) {
    rows.push_back(MeasureTriangles(device, triangles));
    progress.Advance();
  }
  for (const auto& traits : list) {
    if (!options.estimators.empty() &&
        std::find(options.estimators.begin(), options.estimators.end(), traits.name) ==
            options.estimators.end()) {
      progress.Advance(cases.size());
      continue;
    }
    for (const auto& c : cases) {
      rows.push_back(Measure(device, c, traits.name, options.samples_per_pixel));
      progress.Advance();
    }
  }
  if (rows.empty()) throw InputError("bench scale: no estimator or no size to measure; name some");
  for (auto& row : rows) {
    std::vector<double> sizes, seconds;
    for (const auto& other : rows)
      if (other["what"] == row["what"] && other["estimator"] == row["estimator"]) {
        sizes.push_back(other["size"]);
        seconds.push_back(other["core_s"]);
      }
    row["exponent"] = Slope(sizes, seconds);
  }
  return rows;
}

}  // namespace luxfield::bench
