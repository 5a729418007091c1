// What lighting costs on a device: `luxfield bench calibrate` measures it, `luxfield render
// --error` and `--time` choose by it.
//
//   seconds = launch + pixels (pixel + images image + texels texel + samples sample + rays ray)
//
// with coefficients >= 0 per estimator, fitted to runs over synthetic lamps of several sizes by
// weighted least squares (relative errors count). Texels are those in the windows that a pixel
// sees, over all images and channels. The model orders estimators and settings; it is not a
// stopwatch: on other scenes it is within a factor of about 2 (rays within 3).
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/device/device.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

// Sums over the pixels that hit something, for one luminaire.
struct LightingWork {
  double pixels = 0, images = 0, texels = 0, samples = 0, rays = 0;

  std::array<double, 6> Terms() const { return {1, pixels, images, texels, samples, rays}; }
};

struct CostModel {
  std::string device;  // DeviceInfo: name, version and driver
  std::map<std::string, std::array<double, 6>> coefficients_s;  // estimator -> one per term

  bool Knows(const std::string& estimator) const { return coefficients_s.contains(estimator); }
  // Seconds of wall time on the resident G-buffer. The estimator must be known.
  double Seconds(const std::string& estimator, const LightingWork& work) const;
};

// The work of lighting `positions` (a G-buffer's: world, w = 0 where nothing was hit) by one
// luminaire at `samples` per pixel; `traced`: a ray per sample.
LightingWork WorkOf(std::span<const cl_float4> positions,
                    const lightfield::LuminaireGeometry& geometry,
                    const scene::Pose& world_from_luminaire, int samples, bool traced);

struct CalibrationRun {
  std::string estimator;
  LightingWork work;
  double measured_s = 0, predicted_s = 0;
};

// Measures every estimator that states its error; some 10 s on two cores. `runs` (may be null)
// receives what the model was fitted to.
CostModel Calibrate(const Device& device, std::vector<CalibrationRun>* runs = nullptr);

// The device's model in $XDG_CACHE_HOME/luxfield (else ~/.cache/luxfield); empty if there is none
// or it cannot be read.
std::optional<CostModel> StoredCostModel(const Device& device);
// Returns the file, or an empty path where no cache folder can be written.
std::filesystem::path StoreCostModel(const Device& device, const CostModel& model);

}  // namespace luxfield::render
