// An environment map as a light source on a device: radiance, and sampling tables that are made
// there anew for every frame (docs/theory.md 8; kernels/environment/environment_tables.cl).
#pragma once

#include <string>

#include "luxfield/environment/cube_map.h"
#include "luxfield/render/device/device.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

struct EnvironmentTableOptions {
  // Tiles along each side of a face, each with an energy and samples of its own; divides the face
  // size, at most kMaxTiles.
  int tiles_per_side = 1;
  // Sampled is max(0, Y - compensation mean Y) instead of the luminance Y (MIS compensation, Karlik
  // et al. 2019), the mean over the sphere, in [0, 1]. What is left out must be found by samples
  // that follow the BRDF.
  float compensation = 0;

  static constexpr int kMaxTiles = 16;

  // Throws InputError naming the option.
  void Validate(int face_size) const;
  bool operator==(const EnvironmentTableOptions&) const = default;
};

// Device memory: 6 N^2 times 36 bytes, 26 more a row of a tile. A rebuild reads 16 and writes 44
// bytes a texel (float4 texels twice, the sums of columns twice) and computes some 20 operations.
//
// Precision: luminances are float32. Energies of texels are integers in units of 2^-62 to 2^-61 of
// the total; their sums are exact. The unit comes from a sum in float32. What is fainter than the
// unit has density 0.
class EnvironmentLight {
 public:
  // Of N x N texels a face; black until a frame is shown. Throws InputError for options that do not
  // fit and for more than 2^31 texels, DeviceError.
  EnvironmentLight(const Device& device, int face_size,
                   const EnvironmentTableOptions& options = {});

  // Uploads the radiance of a frame and makes its tables. Enqueues and returns; the map may go.
  // Throws InputError for another face size and for radiance that is not in [0, kMaxRadiance].
  void Show(const environment::CubeMap& frame);
  // Makes the tables of the frame that is shown anew, as Show() does.
  void MakeTables();
  // The same with other options.
  void SetOptions(const EnvironmentTableOptions& options);
  // Rotates the map; the translation does not matter.
  void SetPose(const scene::Pose& world_from_environment);

  static constexpr float kMaxRadiance = 1e30f;

  int face_size() const { return face_size_; }
  const EnvironmentTableOptions& options() const { return options_; }
  int tile_count() const { return 6 * options_.tiles_per_side * options_.tiles_per_side; }
  int row_count() const { return 6 * face_size_ * options_.tiles_per_side; }

  // What kernels/environment/environment_sampling.clh reads: EnvironmentParams; float4 radiance and
  // density of energy; ulong sums; float energies of tiles, of a total between 1/2 and 1 (without
  // compensation; 0 for a black map); float4 corners of tiles.
  const Buffer& params() const { return params_; }
  const Buffer& texels() const { return texels_; }
  const Buffer& row_starts() const { return row_starts_; }
  const Buffer& column_starts() const { return column_starts_; }
  const Buffer& energies() const { return energies_; }
  const Buffer& corners() const { return corners_; }

 private:
  void PlaceTiles();  // what depends on the options alone
  void UploadParams();

  Device device_;
  int face_size_;
  EnvironmentTableOptions options_;
  scene::Pose world_from_environment_;
  Kernel rows_, total_, conditional_, marginal_;
  Buffer params_, radiance_, solid_angles_, texels_, totals_, row_sums_, row_starts_,
      column_starts_, energies_, corners_;
};

}  // namespace luxfield::render
