// Shadow maps of a luminaire: which of its u-cells a receiver sees, without a ray per sample
// (thesis 4.5.2, docs/theory.md 6).
//
//   v_m(p) = mean over the n x n cells c under Phi_m of V_c(p)
//   V_c(p) = 1 if nothing lies between p and the light position of cell c, else 0
//
// There is one map for each of the (W + n - 1)(H + n - 1) cells that the knots cut F into. A map is
// a pinhole picture of the scene's depths, from the light position along +z of the luminaire, in
// float32, made by a ray through every texel's centre. It spans the directions in which light of
// the images over the cell reaches receivers at least delta away, and a border of some texels; what
// lies outside of it counts as seen.
//
// A texel has the width f = z * (tangents that the map spans) / size at the distance z from the
// light position; f is about z / 80 for an image plane twice as wide as delta and 192 texels.
// Receivers are lifted by 0.78 f (half of a texel's diagonal, and a tenth more) along their normal,
// so that no surface shades itself, whatever the angle, where its normal is true to some 25
// degrees. In return an occluder closer than 0.78 f to the surface may lose its shadow, and the
// edge of a shadow may be off by 1.5 f.
#pragma once

#include <cstddef>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/tables.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/scene/gbuffer.h"
#include "luxfield/render/scene/ray_scene.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

// Where the light of a u-cell comes from, luminaire frame, metres; index
// cell_j * (W + n - 1) + cell_i.
struct CellLight {
  lightfield::Vec3 position;
  bool lit = false;  // some image whose basis covers the cell is not all zero
};

// The cells' centres on F, where the shadow rays of traced visibility end too; `lit_images` says of
// each image whether it holds light.
std::vector<CellLight> CellCentres(const lightfield::BasisGrid& grid,
                                   const std::vector<bool>& lit_images);
std::vector<CellLight> CellCentres(const lightfield::LightField& field);

// The thesis' choice: the cells' reference positions on I (preprocess::ReferencePosition). Far
// less accurate: light from a cell passes through I where the receiver is, not where most of it
// passes.
std::vector<CellLight> ReferencePositions(
    const lightfield::LuminaireGeometry& luminaire,
    const std::vector<preprocess::ReferencePosition>& reference);

class ShadowMaps {
 public:
  static constexpr int kMinSize = 16, kMaxSize = 4096;  // texels

  // Of a grid, with the maps of cells that are not lit.
  static int CellCount(const lightfield::BasisGrid& grid) {
    return (grid.width + grid.basis.cells - 1) * (grid.height + grid.basis.cells - 1);
  }
  static std::size_t Bytes(const lightfield::BasisGrid& grid, int size);

  // Casts the maps of the lit cells: size^2 rays each. Throws InputError for a size outside of
  // [kMinSize, kMaxSize] and for more maps than the device can hold; DeviceError.
  ShadowMaps(const Device& device, const lightfield::LuminaireGeometry& luminaire,
             const std::vector<CellLight>& lights, const scene::Pose& world_from_luminaire,
             const RayScene& rays, int size = 192);

  // uint seen[pixel * words + cell / 32], bit cell % 32, words = cells / 32 rounded up
  // (kernels/luminaire/shadow_maps.clh: SeesCell, ImageVisibility). Undefined where the G-buffer
  // hit nothing.
  // Enqueues and returns.
  Buffer SeeCells(const GBuffer& gbuffer) const;

  int map_count() const { return map_count_; }
  int size() const { return size_; }

 private:
  void Cast(const RayScene& scene, std::size_t texels);

  Device device_;
  int cells_ = 0, map_count_ = 0, size_ = 0;
  Buffer params_, views_, depth_;
  mutable Kernel see_cells_;  // its arguments are set anew for every launch
};

}  // namespace luxfield::render
