// Classical lights on a device (docs/theory.md 15): a far field I, in cd, that leaves every point of
// an extent alike, so that its light at p is
//
//   point    E = I(w) (n . w)+ / r^2
//   linear   E = 1 / l integral over the line of I(w) (n . w)+ / r^2 dx
//   area     E = 1 / A integral over the area of I(w) (n . w)+ / r^2 dA
//
// w is the direction to the point, r its distance; I is asked for -w. Of the area that is the
// radiance L = I / (A |cos|), |cos| to its normal, on both of its sides. All samples of a point are
// the same, so that no more than two are drawn. The thesis' Table 2.1 has these rows; its columns,
// 0, 1 and 2 dimensions of direction, are tables of one intensity, of one plane and of several.
#pragma once

#include <array>
#include <memory>

#include "luxfield/core/colour.h"
#include "luxfield/formats/photometric.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/kernels/area/classical_light_types.clh"
#include "luxfield/render/kernels/lights/light_tree_types.clh"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

// A photometric file's table on a device, bilinear in its own angles as formats::Intensity.
struct Distribution {
  Distribution(const Device& device, formats::Photometry photometry);

  formats::Photometry photometry;
  Buffer table;  // as ClassicalLightParams says
  // What the tree over lights keeps of |I|: its integral over all directions, and bounds of the mean
  // over the azimuths by angle to +z, 0 only where there is no light.
  double flux = 0;
  std::array<double, kProfileBins> profile{};
};

struct ClassicalLightSource {
  scene::ClassicalModel model = scene::ClassicalModel::kPoint;
  ClassicalLightParams params{};
  std::shared_ptr<const Distribution> distribution;
  core::Rgb colour = {1, 1, 1};  // factors of its channels, which `params` leaves out
  double extent = 1;             // its length in m or area in m2, of a point 1
};

// Stands it elsewhere, with its light times `scale`.
void Place(const scene::Pose& world_from_light, double scale, ClassicalLightSource& light);

// Whether it has a radiance, that directions drawn otherwise can meet.
inline bool IsArea(const ClassicalLightSource& light) {
  return light.model == scene::ClassicalModel::kArea;
}

// An extent in the plane z = 0, its middle at the origin.
struct Extent {
  double x_m = 0, y_m = 0;
  bool is_ellipse = false;
};

// The extent of a light whose file has that opening: what the scene states, else the opening. Of a
// linear light it is the longer side of a rectangle, or the axis of a lying cylinder, which is taken
// as that line. Throws InputError naming the file where the opening is none of these.
Extent ExtentOf(const scene::ClassicalLight& light, const formats::Opening& opening);

// Throws InputError as ExtentOf.
ClassicalLightSource MakeClassicalLight(const scene::ClassicalLight& light,
                                        std::shared_ptr<const Distribution> distribution);

}  // namespace luxfield::render
