// A tree over the luminaires, area lights and classical lights of a scene, which says what they bring to a receiver
// without asking each (docs/theory.md 6; Conty Estevez and Kulla 2018).
//
// Of a light: where it shines from, its flux, and its intensity by direction, of luminaires from
// preprocess/intensity_table.h. A node holds a sphere around all that shines in it, the flux, an axis
// and a profile: with e_k = pi (k / 8)^2,
//
//   profile_k = sum over its lights of a bound of the mean intensity over the azimuths at
//               angles in [e_k, e_(k+1)] to the axis
//
// which is 0 only where none of its lights shines; and a bound of the luminaires' light likewise,
//
//   E <= sum over its lights of   bound(angle) max (n . w)+ / |u - p|^2
//
// of receivers so far away that all of a luminaire is seen under a single bin of tangents and its
// neighbours.
//
// Luminaires are alike that show one table with their axes along the same lines. A node of such
// luminaires also holds a box around them, along those axes, and the sum of their scales: what it
// brings is then asked of the table itself, as of one luminaire. A kind of which there are 8 luminaires
// and an eighth of all gets a node of its own. Else lights are split where
//
//   sum over both sides of   flux * |box diagonal|^2 * (2 - |sum flux axis| / flux)
//
// is least, of 16 places along each axis.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "luxfield/preprocess/intensity_table.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/kernels/lights/light_tree_types.clh"
#include "luxfield/render/lights/area_light.h"
#include "luxfield/render/lights/classical_light.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

// A light as the tree sees it.
struct BoundedLight {
  TreeLight light{};
  double reach_m = 0;  // around light.position
  lightfield::Vec3 axis{0, 0, 1};
  double power = 0;
  std::array<double, kProfileBins> profile{}, bounds{};  // about the axis
  double bounded_m = 0;  // the least distance at which the latter hold
};

// The `number`-th of the tables that a tree is given, and what nodes keep of it.
struct BoundedTable {
  // The caller keeps `table`.
  BoundedTable(const preprocess::IntensityTable& table, std::size_t number);

  const preprocess::IntensityTable* table;
  std::size_t number;
  double widest_angle;  // to the axis, of all that it holds
  std::array<double, kProfileBins> profile, bounds;
};

// Lights times `scale`; of a light with a scale for each channel their largest, so that its luminance
// is bounded whatever its colour.
BoundedLight BoundLuminaire(const lightfield::LuminaireGeometry& geometry,
                            const BoundedTable& table, const scene::Pose& world_from_luminaire,
                            double scale);
BoundedLight BoundClassicalLight(const ClassicalLightSource& light, double scale);
BoundedLight BoundAreaLight(const AreaLightSource& light);

// Of |I|, about +z: Distribution's profile and flux, by quadrature.
void BoundIntensity(const formats::Photometry& photometry,
                    std::array<double, kProfileBins>& profile, double& flux);

// Nodes in depth-first order, the root first; none of no lights. Depth is below kMostDepth.
std::vector<LightNode> BuildLightTree(std::span<const BoundedLight> lights);

// The tree on a device.
struct LightTree {
  Buffer nodes, lights;  // LightNode, TreeLight
  Buffer tables;         // float: sums of all intensity tables
};

// At least one light. BoundedLight::light.table is replaced by the table's place.
LightTree UploadLightTree(const Device& device, std::span<const BoundedLight> lights,
                          std::span<const BoundedTable> tables);

}  // namespace luxfield::render
