// What estimators cost on one compute unit of a class of devices, as `luxfield bench calibrate`
// measured it: on two cores of a Xeon with AVX-512 (PoCL 3.1, processor time) and on the 132 units
// of an NVIDIA H200 (driver 580, time of the clock). Pictures refine it (Refine).
#include <algorithm>
#include <array>
#include <span>

#include "luxfield/render/accuracy/cost_model.h"

namespace luxfield::render {
namespace {

struct ShippedCosts {
  const char* estimator;
  // Launch, pixel, image, texel, sample, ray; seconds of one compute unit, the launch's of all.
  std::array<double, 6> coefficients_s;
};

constexpr ShippedCosts kCpu[] = {
    {"basis", {1.8e-4, 3.1e-7, 2.3e-8, 2.8e-10, 1.5e-7, 6.8e-8}},
    {"cells", {1.1e-4, 1.7e-6, 9.0e-9, 8.1e-10, 2.1e-7, 1.4e-7}},
    {"exact", {0, 2.0e-7, 2.7e-8, 1.7e-10, 4.4e-7, 0}},
    {"gloss", {0, 3.3e-7, 2.2e-8, 1.7e-10, 5.2e-7, 0}},
    {"precomputed", {8.9e-5, 0, 0, 5.4e-10, 1.9e-7, 8.1e-8}},
    {"uniform", {0, 6.3e-7, 4.4e-9, 2.7e-10, 3.9e-8, 6.7e-8}},
    {"volume", {3.1e-5, 2.7e-8, 3.4e-10, 0, 3.8e-7, 0}},
    {"windowed", {0, 0, 0, 5.7e-10, 1.8e-7, 2.9e-8}},
};

constexpr ShippedCosts kGpu[] = {
    {"basis", {1.6e-4, 0, 1.2e-8, 4.5e-11, 2.9e-8, 3.5e-8}},
    {"cells", {2.3e-4, 0, 2.6e-8, 2.6e-10, 5.9e-8, 6.6e-8}},
    {"exact", {8.3e-5, 1.6e-6, 1.5e-7, 2.2e-9, 2.3e-7, 0}},
    {"gloss", {9.4e-5, 1.4e-6, 1.5e-7, 2.2e-9, 2.3e-7, 0}},
    {"precomputed", {1.5e-4, 0, 2.3e-8, 6.6e-11, 2.4e-8, 3.7e-9}},
    {"uniform", {1.4e-4, 0, 1.2e-8, 2.1e-11, 1.3e-8, 2.3e-8}},
    {"volume", {1.0e-4, 9.7e-7, 1.1e-7, 0, 5.6e-7, 0}},
    {"windowed", {1.9e-4, 0, 1.3e-8, 1.5e-10, 5.7e-8, 5.1e-8}},
};

}  // namespace

CostModel ShippedCostModel(const DeviceInfo& info) {
  CostModel model;
  model.device = info.name;
  for (const ShippedCosts& costs : info.is_cpu ? std::span<const ShippedCosts>(kCpu) : kGpu) {
    auto coefficients = costs.coefficients_s;
    for (std::size_t a = 1; a < coefficients.size(); ++a)
      coefficients[a] /= std::max(1, info.compute_units);
    model.coefficients_s[costs.estimator] = coefficients;
  }
  return model;
}

}  // namespace luxfield::render
