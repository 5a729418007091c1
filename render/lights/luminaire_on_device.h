// A luminaire on a device: coefficient images and what estimators read besides.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/preprocess/light_vector_volume.h"
#include "luxfield/preprocess/patch_light.h"
#include "luxfield/preprocess/tables.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

// Tables of a luminaire on the host, null where there are none; what each estimator needs its
// traits say.
struct LuminaireTables {
  const preprocess::Tables* sat = nullptr;
  const preprocess::CellTables* cells = nullptr;
  const preprocess::LightVectorVolume* volume = nullptr;
  const preprocess::PatchLight* patches = nullptr;
};

// Puts image m of all channels, [channel][row][column], where it is asked for.
using ImageSource = std::function<void(int m, std::span<float> planes)>;

// The coefficient images and tables of one luminaire, uploaded once. Texels are padded on the right
// so that wide loads stay inside the buffer.
class LuminaireOnDevice {
 public:
  static constexpr int kRowPadding = 32;

  // What each image takes on the device.
  static std::size_t ImageBytes(const lightfield::LuminaireGeometry& geometry) {
    return static_cast<std::size_t>(geometry.lattice.width + kRowPadding) *
           static_cast<std::size_t>(geometry.lattice.height) *
           static_cast<std::size_t>(geometry.channels) * sizeof(float);
  }

  // The tables must belong to `field` (preprocess::CheckTables). Throws InputError if the device
  // cannot hold them.
  LuminaireOnDevice(const Device& device, const lightfield::LightField& field,
                    const LuminaireTables& tables = {});
  // The same of images that come one after the other, none of which is kept on the host. Passes on
  // what `source` throws.
  LuminaireOnDevice(const Device& device, const lightfield::LuminaireGeometry& geometry,
                    const ImageSource& source);
  void Add(const Device& device, const LuminaireTables& tables);

  // The images again, to the bit, without provenance.
  lightfield::LightField Download() const;
  // Of each image, whether any C is not 0.
  std::vector<bool> LitImages() const;

  const lightfield::LuminaireGeometry& geometry() const { return geometry_; }
  // float C[((m * channels + channel) * height + row) * row_stride + column], zero in the padding.
  const Buffer& images() const { return images_; }
  int row_stride() const { return row_stride_; }
  bool has_sat() const { return static_cast<bool>(sat_); }
  // ulong S[(m * (height + 1) + row) * SatStride(width) + column] (preprocess::Tables::sat;
  // kernels/luminaire/luminaire_types.clh), and for each image float 2^(62 - exponent):
  // mass = S * 2^-62 * scale.
  const Buffer& sat() const { return sat_; }
  const Buffer& sat_scale() const { return sat_scale_; }
  // The same per knot cell (preprocess::CellTables).
  bool has_cells() const { return static_cast<bool>(cell_sat_); }
  const Buffer& cell_sat() const { return cell_sat_; }
  const Buffer& cell_scale() const { return cell_scale_; }
  bool has_volume() const { return static_cast<bool>(volume_params_); }
  // VolumeParams, and coefficients (preprocess::LightVectorVolume), [channel][B0, B1_u, B1_v][tau][a_y]
  // [a_x]; the latter null if the volume has none.
  const Buffer& volume_params() const { return volume_params_; }
  const Buffer& volume() const { return volume_; }
  // The light of the filter plane's patches (preprocess::PatchLight): float16 per node, the axes
  // that it is tabulated over, its values left out, and which patches are lit.
  bool has_patches() const { return static_cast<bool>(patch_light_); }
  const Buffer& patch_light() const { return patch_light_; }
  const preprocess::PatchLight& patch_axes() const { return patch_axes_; }
  std::uint32_t lit_patches() const { return lit_patches_; }  // bit k: patch k

 private:
  lightfield::LuminaireGeometry geometry_;
  int row_stride_ = 0;
  Buffer images_, sat_, sat_scale_, cell_sat_, cell_scale_, volume_params_, volume_, patch_light_;
  preprocess::PatchLight patch_axes_;
  std::uint32_t lit_patches_ = 0;
};

}  // namespace luxfield::render
