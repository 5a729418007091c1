#include "luxfield/bench/bench_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/accuracy/lamp_tables.h"

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
  double wall_s = std::numeric_limits<double>::infinity(), core_s = wall_s, spent_s = 0;
  const auto light = [&](const render::GBuffer& receivers, render::Lighting& sum) {
    estimator->Light({receivers}, render::PosedLuminaire{luminaire}, options, sum);
    device.Finish();
  };
  const auto few = render::RoadGBuffer(device, 16, 12);
  render::Lighting warm_up(device, few);
  light(few, warm_up);  // compiles
  for (int run = 0; run < kMostRuns && spent_s < kEnough_s; ++run) {
    lighting.Clear();
    device.Finish();
    const core::Stopwatch stopwatch;
    light(gbuffer, lighting);
    wall_s = std::min(wall_s, stopwatch.WallSeconds());
    core_s = std::min(core_s, stopwatch.CoreSeconds());
    spent_s += stopwatch.WallSeconds();
  }
  return {{"what", c.what},
          {"estimator", name},
          {"size", c.size},
          {"wall_s", wall_s},
          {"core_s", core_s},
          {"build_core_s", tables.core_s},
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
  core::Progress progress("bench scale", cases.size() * list.size());
  nlohmann::json rows = nlohmann::json::array();
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
