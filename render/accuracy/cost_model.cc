#include "luxfield/render/accuracy/cost_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "luxfield/core/cache.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/preprocess/scene_receivers.h"
#include "luxfield/render/accuracy/car2.h"
#include "luxfield/render/accuracy/lamp_tables.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::render {
namespace {

constexpr int kTerms = 6;
constexpr int kVersion = 4;  // raised where what an estimator does, and so its cost, changes
constexpr const char* kTermNames[kTerms] = {"launch",    "per_pixel",  "per_image",
                                            "per_texel", "per_sample", "per_ray"};

std::string DeviceName(const DeviceInfo& info) {
  return fmt::format("{}; {}; {}; {} compute units", info.name, info.version, info.driver,
                     info.compute_units);
}

// Least squares with x >= 0 by coordinate descent on the normal equations; rows are already
// weighted.
std::array<double, kTerms> NonNegativeLeastSquares(
    const std::vector<std::array<double, kTerms>>& rows, const std::vector<double>& right) {
  double gram[kTerms][kTerms] = {}, moment[kTerms] = {};
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (int a = 0; a < kTerms; ++a) {
      moment[a] += rows[r][a] * right[r];
      for (int b = 0; b < kTerms; ++b) gram[a][b] += rows[r][a] * rows[r][b];
    }
  std::array<double, kTerms> x{};
  for (int sweep = 0; sweep < 20000; ++sweep)
    for (int a = 0; a < kTerms; ++a) {
      if (!(gram[a][a] > 0)) continue;
      double rest = moment[a];
      for (int b = 0; b < kTerms; ++b)
        if (b != a) rest -= gram[a][b] * x[b];
      x[a] = std::max(0.0, rest / gram[a][a]);
    }
  return x;
}

std::array<double, kTerms> Fit(const std::vector<CalibrationRun>& runs) {
  std::vector<std::array<double, kTerms>> rows;
  std::array<double, kTerms> largest{};
  for (const auto& run : runs) {
    auto row = run.work.Terms();
    for (int a = 0; a < kTerms; ++a) {
      row[a] /= run.measured_s;
      largest[a] = std::max(largest[a], row[a]);
    }
    rows.push_back(row);
  }
  // Columns of like size, so that the descent converges.
  for (auto& row : rows)
    for (int a = 0; a < kTerms; ++a)
      if (largest[a] > 0) row[a] /= largest[a];
  auto x = NonNegativeLeastSquares(rows, std::vector<double>(rows.size(), 1.0));
  for (int a = 0; a < kTerms; ++a) x[a] = largest[a] > 0 ? x[a] / largest[a] : 0;
  return x;
}

// Something for shadow rays to miss and hit.
std::unique_ptr<RayScene> CalibrationScene(const Device& device) {
  scene::Geometry geometry;
  geometry.materials.emplace_back();
  for (int row = 0; row < 16; ++row)
    for (int column = 0; column < 16; ++column)
      scene::AppendBox(scene::Translation({0.4 * column - 3.2, -0.6, 0.4 + 0.6 * row}) *
                           scene::Scaling({0.1, 0.1 + 0.02 * (row + column), 0.1}),
                       0, geometry);
  return MakeRayScene(device, geometry);
}

struct CalibrationSetting {
  SyntheticCar2Options lamp;
  int width, height, samples;
  bool traced;
};

double LightSeconds(const Device& device, Estimator& estimator, const GBuffer& gbuffer,
                    const Visibility& visibility, const LuminaireOnDevice& luminaire, int samples) {
  Lighting lighting(device, gbuffer);
  EstimatorOptions options;
  options.samples_per_pixel = samples;
  double best_s = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 3; ++run) {  // the first one compiles
    lighting.Clear();
    device.Finish();
    const core::Stopwatch stopwatch;
    estimator.Light({gbuffer, visibility}, PosedLuminaire{luminaire}, options, lighting);
    device.Finish();
    if (run == 0) continue;
    const DeviceInfo& info = device.info();
    best_s = std::min(best_s, info.is_cpu ? stopwatch.CoreSeconds() / info.compute_units
                                          : stopwatch.WallSeconds());
  }
  return best_s;
}

}  // namespace

double CostModel::Seconds(const std::string& estimator, const LightingWork& work) const {
  const auto& coefficients = coefficients_s.at(estimator);
  const auto terms = work.Terms();
  double seconds = 0;
  for (int a = 0; a < kTerms; ++a) seconds += coefficients[a] * terms[a];
  return seconds;
}

LightingWork WorkOf(std::span<const cl_float4> positions,
                    const lightfield::LuminaireGeometry& geometry,
                    const scene::Pose& world_from_luminaire, int samples, bool traced) {
  const auto luminaire_from_world = world_from_luminaire.Inverse();
  LightingWork work;
  for (const auto& position : positions) {
    if (position.s[3] == 0) continue;
    const auto p = luminaire_from_world.Point({position.s[0], position.s[1], position.s[2]});
    if (!(p.z > 0)) continue;
    ++work.pixels;
    work.texels += preprocess::TexelsSeen(geometry, p) * geometry.channels;
  }
  work.images = work.pixels * geometry.grid.count();
  work.samples = work.pixels * samples;
  work.rays = traced ? work.samples : 0;
  return work;
}

CostModel Calibrate(const Device& device, std::vector<CalibrationRun>* runs) {
  CostModel model;
  model.device = DeviceName(device.info());
  const auto rays = CalibrationScene(device);
  std::map<std::string, std::vector<CalibrationRun>> measured;
  std::map<std::string, std::unique_ptr<Estimator>> estimators;
  for (const auto& traits : EstimatorList())
    if (traits.unbiased || traits.noise_free)
      estimators[traits.name] = MakeEstimator(traits.name, device);
  const CalibrationSetting settings[] = {
      {{3, 3, 64, 1}, 32, 24, 16, false},    {{3, 3, 64, 1}, 128, 96, 16, false},
      {{3, 3, 256, 1}, 128, 96, 128, false}, {{11, 9, 64, 3}, 128, 96, 16, false},
      {{11, 9, 256, 1}, 128, 96, 64, false}, {{11, 9, 64, 1}, 128, 96, 64, true}};
  for (const CalibrationSetting& setting : settings) {
    const auto field = SyntheticCar2(setting.lamp);
    const auto gbuffer = RoadGBuffer(device, setting.width, setting.height);
    // Looking up the volume costs the same whatever its resolution.
    const LampTables tables =
        BuildLampTables(field, gbuffer, {.sat = true, .cells = true, .volume = true}, 0.1);
    const LuminaireOnDevice luminaire(device, field, tables.view());
    const auto positions = gbuffer.position.Download<cl_float4>();
    for (const auto& [name, estimator] : estimators) {
      const auto& traits = estimator->traits();
      CalibrationRun run{
          name,
          WorkOf(positions, field.geometry, {},
                 traits.noise_free && !setting.traced ? 0 : setting.samples, setting.traced),
          0, 0};
      run.measured_s =
          LightSeconds(device, *estimator, gbuffer, {.rays = setting.traced ? rays.get() : nullptr},
                       luminaire, setting.samples);
      measured[name].push_back(run);
    }
  }
  for (auto& [name, list] : measured) {
    model.coefficients_s[name] = Fit(list);
    if (!runs) continue;
    for (auto& run : list) {
      run.predicted_s = model.Seconds(name, run.work);
      runs->push_back(run);
    }
  }
  return model;
}

namespace {

core::CacheKey KeyOf(const Device& device) {
  return {"costs", fmt::format("{}\n{}", kVersion, DeviceName(device.info()))};
}

std::optional<CostModel> KeptCostModel(const Device& device) {
  const auto text = core::FindInCache(KeyOf(device));
  if (!text) return std::nullopt;
  try {
    CostModel model;
    model.device = DeviceName(device.info());
    const core::Json estimators = core::Json::parse(*text);
    for (const auto& [name, terms] : estimators.items())
      for (int a = 0; a < kTerms; ++a)
        model.coefficients_s[name][a] = core::Field<double>(terms, kTermNames[a], "cost model");
    return model;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace

CostModel CurrentCostModel(const Device& device) {
  return KeptCostModel(device).value_or(ShippedCostModel(device.info()));
}

bool KeepCostModel(const Device& device, const CostModel& model) {
  core::Json estimators;
  for (const auto& [name, coefficients] : model.coefficients_s)
    for (int a = 0; a < kTerms; ++a) estimators[name][kTermNames[a]] = coefficients[a];
  return core::PutIntoCache(KeyOf(device), estimators.dump());
}

void Refine(CostModel& model, const std::string& estimator, const LightingWork& work,
            double measured_s) {
  constexpr double kShare = 0.25, kMost = 2;
  const double predicted_s = model.Knows(estimator) ? model.Seconds(estimator, work) : 0;
  if (!(predicted_s > 0) || !(measured_s > 0)) return;
  const double factor = std::clamp(std::pow(measured_s / predicted_s, kShare), 1 / kMost, kMost);
  for (double& coefficient : model.coefficients_s[estimator]) coefficient *= factor;
}

}  // namespace luxfield::render
