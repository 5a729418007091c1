#include "luxfield/render/lights/classical_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/render/lights/light_tree.h"

namespace luxfield::render {
namespace {

using formats::Opening;
using formats::PhotometryType;
using scene::ClassicalModel;

int TableAnglesOf(PhotometryType type) {
  return type == PhotometryType::kA   ? kTableOfTypeA
         : type == PhotometryType::kB ? kTableOfTypeB
                                      : kTableOfTypeC;
}

std::vector<float> TableOf(const formats::Photometry& photometry) {
  std::vector<float> table;
  for (const auto* list :
       {&photometry.planes_deg, &photometry.angles_deg, &photometry.intensity_cd})
    for (const double value : *list) table.push_back(static_cast<float>(value));
  return table;
}

// Of a flat rectangle or ellipse.
bool IsFlat(const Opening& opening) {
  return (opening.shape == Opening::Shape::kBox || opening.shape == Opening::Shape::kEllipse) &&
         opening.height_m == 0 && opening.c0_m > 0 && opening.c90_m > 0;
}

Extent LineOf(const Opening& opening) {
  using enum Opening::Shape;
  if (opening.shape == kCylinderAlongC0) return {opening.c0_m, 0};
  if (opening.shape == kCylinderAlongC90) return {0, opening.c90_m};
  if (opening.shape != kBox || opening.height_m > 0 || opening.c0_m == opening.c90_m) return {};
  return opening.c0_m > opening.c90_m ? Extent{opening.c0_m, 0} : Extent{0, opening.c90_m};
}

}  // namespace

Distribution::Distribution(const Device& device, formats::Photometry of_file)
    : photometry(std::move(of_file)), table(Buffer::From(device, TableOf(photometry))) {
  BoundIntensity(photometry, profile, flux);
}

Extent ExtentOf(const scene::ClassicalLight& light, const Opening& opening) {
  if (light.model == ClassicalModel::kPoint) return {};
  if (light.size_m) return {(*light.size_m)[0], (*light.size_m)[1]};
  if (light.model == ClassicalModel::kArea) {
    if (IsFlat(opening))
      return {opening.c0_m, opening.c90_m, opening.shape == Opening::Shape::kEllipse};
    throw InputError(light.distribution.string(),
                     fmt::format("its opening is {}, which is no flat area; the luminaire '{}' "
                                 "needs one",
                                 Describe(opening), light.name),
                     "state its size = [along x, along y], in metres, or choose another model");
  }
  const Extent line = LineOf(opening);
  if (line.x_m + line.y_m > 0) return line;
  throw InputError(light.distribution.string(),
                   fmt::format("its opening is {}, which is no line; the luminaire '{}' needs one",
                               Describe(opening), light.name),
                   "state its size = [length, 0] or [0, length], in metres, or choose another "
                   "model");
}

ClassicalLightSource MakeClassicalLight(const scene::ClassicalLight& light,
                                        std::shared_ptr<const Distribution> distribution) {
  const formats::Photometry& photometry = distribution->photometry;
  const Extent extent = ExtentOf(light, photometry.opening);
  ClassicalLightParams params{};
  params.half_size[0] = static_cast<float>(extent.x_m / 2);
  params.half_size[1] = static_cast<float>(extent.y_m / 2);
  params.is_ellipse = extent.is_ellipse;
  const double measure = light.model == ClassicalModel::kPoint    ? 1
                         : light.model == ClassicalModel::kLinear ? extent.x_m + extent.y_m
                         : extent.is_ellipse ? std::numbers::pi / 4 * extent.x_m * extent.y_m
                                             : extent.x_m * extent.y_m;
  params.table_angles = TableAnglesOf(photometry.type);
  params.planes = static_cast<int>(photometry.planes_deg.size());
  params.angles = static_cast<int>(photometry.angles_deg.size());
  ClassicalLightSource source{light.model, params, std::move(distribution), light.colour, measure};
  Place(light.world_from_light, light.scale, source);
  return source;
}

void Place(const scene::Pose& world_from_light, double scale, ClassicalLightSource& light) {
  ClassicalLightParams& params = light.params;
  const auto& [x, y, z] = world_from_light.translation;
  const double middle[] = {x, y, z};
  for (int row = 0; row < 3; ++row) {
    params.position[row] = static_cast<float>(middle[row]);
    // The inverse of a rotation is its transpose.
    for (int column = 0; column < 3; ++column)
      params.rotation[3 * row + column] = static_cast<float>(world_from_light.linear[column][row]);
  }
  params.strength = static_cast<float>(scale / light.extent);
}

}  // namespace luxfield::render
