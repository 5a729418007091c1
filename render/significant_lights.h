// Which luminaires estimators without noise need to light which points with (docs/theory.md 6): the
// others bring nothing there, or so little together that it stays below a share of all light, by
// bounds of the tree over them (kernels/lights/significant_lights.cl).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "luxfield/render/lights/light_tree.h"
#include "luxfield/render/scene/gbuffer.h"

namespace luxfield::render {

class SignificantLights {
 public:
  // `lights` are luminaires, `tables` those that they name.
  SignificantLights(const Device& device, std::span<const BoundedLight> lights,
                    std::span<const BoundedTable> tables);

  // Of each light the points where it matters, rising. What is left out of a point is at most
  // `share` of about the irradiance that all lights bring; 0: it is nothing. Waits.
  std::vector<std::vector<std::size_t>> PointsOf(const GBuffer& gbuffer, double share);

 private:
  Device device_;
  std::size_t count_;
  LightTree tree_;
  Kernel count_kernel_, find_kernel_;
};

}  // namespace luxfield::render
