// What lighting costs on a device, which `luxfield render --error` and `--time` begin with before
// pilots tell: shipped for classes of devices, refined by what each picture took, or measured by
// `luxfield bench calibrate`.
//
//   seconds = launch + pixels (pixel + images image + texels texel + samples sample + rays ray)
//
// with coefficients >= 0 per estimator, fitted to runs over synthetic lamps of several sizes by
// weighted least squares (relative errors count). Seconds are processor time shared by all cores
// of a CPU, which other load changes little; of GPUs those of the clock. Texels are those in the
// windows that a pixel sees, over all images and channels. The model orders estimators and
// settings; it is not a stopwatch: on other scenes it is within a factor of about 2 (rays within
// 3).
#pragma once

#include <array>
#include <map>
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
  // Seconds on the resident G-buffer. The estimator must be known.
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

// What is shipped for a device that nothing was measured on (render/accuracy/shipped_costs.cc): of
// CPUs and of GPUs, by their compute units.
CostModel ShippedCostModel(const DeviceInfo& info);

// The device's own model, which was measured or refined here before, from the cache (core/cache.h);
// else the shipped one.
CostModel CurrentCostModel(const Device& device);
// Keeps it as the device's own; whether that worked.
bool KeepCostModel(const Device& device, const CostModel& model);

// Moves the costs of an estimator towards what a picture took: by a quarter of the way, in
// logarithms, and by at most a factor of 2.
void Refine(CostModel& model, const std::string& estimator, const LightingWork& work,
            double measured_s);

}  // namespace luxfield::render
