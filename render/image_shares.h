// How many of a luminaire's images light a point.
//
//   share(p) = (sum_m a_m)^2 / (M sum_m a_m^2),   a_m = sum of |C_m| over the texels that p sees
//
// through the support of basis function m: 1 where all M images bring the same, 1/M where one alone
// does. Image samplers draw from so many (docs/theory.md 6).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/lit_scene.h"

namespace luxfield::render {

// Holds sums of all texels of a light field: 8 bytes each.
class ImageShares {
 public:
  explicit ImageShares(const lightfield::LightField& field);

  // At a point in the luminaire's frame; empty where no image sends light.
  std::optional<double> At(lightfield::Vec3 p) const;

 private:
  double SumOf(std::size_t image, std::size_t c0, std::size_t r0, std::size_t c1,
               std::size_t r1) const;

  lightfield::LuminaireGeometry geometry_;
  std::vector<double>
      sums_;  // of image m: of the rows and columns before, (height + 1) (width + 1)
};

// At points of the world, the mean over the scene's luminaires that send light there; NaN where none
// does. Throws Interrupted.
core::Image ImageSharesAt(const LitScene& scene, std::span<const lightfield::Vec3> points);

}  // namespace luxfield::render
