#include "luxfield/planning/chain.h"

#include <cmath>

#include "luxfield/core/stopwatch.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"

namespace luxfield::planning {
ChainResult RunChain(const ChainOptions& options) {
  ChainResult result;
  std::filesystem::create_directories(options.folder);
  const auto session_folder = options.folder / "session";
  core::Stopwatch watch;
  {
    const capture::Plan plan = capture::ReadPlan(options.plan);
    hal::Devices devices = hal::MakeDevices(options.lab, options.seed, plan.stage);
    result.capture = capture::RunCapture(plan, devices, session_folder);
  }
  result.capture_s = watch.WallSeconds();
  watch = {};

  const auto measurements_file = options.folder / (options.name + ".meas.exr");
  reconstruct::MergeSessionOptions how;
  how.calibrations = options.calibrations;
  how.lamp_level =
      reconstruct::LampLevel::kMonitorUnity;  // the truth is the lamp at its nominal level
  result.measurements =
      reconstruct::MergeSession(session::SessionReader(session_folder), how, &result.merge);
  lightfield::WriteMeasurements(measurements_file, result.measurements);
  if (!options.keep_session) std::filesystem::remove_all(session_folder);
  result.merge_s = watch.WallSeconds();
  watch = {};

  result.reconstruction = reconstruct::Reconstruct(lightfield::ReadMeasurements(measurements_file));
  lightfield::WriteLightField(options.folder / (options.name + ".signed.lf.exr"),
                              result.reconstruction.coefficients);
  result.reconstruct_s = watch.WallSeconds();
  return result;
}

StageError CompareWithTruth(std::span<const float> values, std::span<const float> truth) {
  double square = 0, sum = 0, power = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double d = double{values[k]} - truth[k];
    square += d * d;
    sum += truth[k];
    power += double{truth[k]} * truth[k];
  }
  const auto n = static_cast<double>(truth.size());
  return {std::sqrt(square / n) / (sum / n), std::sqrt(square / power)};
}

StageError IrradianceError(const lightfield::Measurements& measurements,
                           const std::vector<std::vector<float>>& truth) {
  const std::size_t pixels = measurements.geometry.plane_size();
  std::vector<float> values, references;
  for (std::size_t m = 0; m < truth.size(); ++m) {
    const auto& position = measurements.positions[m];
    for (std::size_t k = 0; k < truth[m].size(); ++k)
      if (!(position.mask[k % pixels] & lightfield::kUnknownMask)) {
        values.push_back(position.irradiance[k]);
        references.push_back(truth[m][k]);
      }
  }
  return CompareWithTruth(values, references);
}

}  // namespace luxfield::planning
