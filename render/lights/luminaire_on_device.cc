#include "luxfield/render/lights/luminaire_on_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/unset_vector.h"
#include "luxfield/render/kernels/luminaire/luminaire_types.clh"
#include "luxfield/render/kernels/luminaire/volume_types.clh"

namespace luxfield::render {
namespace {

void RequireRoom(const Device& device, const char* what, std::size_t bytes) {
  if (bytes > device.info().max_allocation_bytes)
    throw InputError(
        fmt::format("the luminaire's {} take {:.0f} MiB, device '{}' allocates at most {:.0f} MiB "
                    "at once; use a light "
                    "field with fewer or smaller images, or another --device",
                    what, static_cast<double>(bytes) / 0x1p20, device.info().name,
                    static_cast<double>(device.info().max_allocation_bytes) / 0x1p20));
}

VolumeAxisParams MakeVolumeAxis(const preprocess::VolumeAxis& axis) {
  if (axis.nodes == 0) return {};
  return {static_cast<float>(axis.first), static_cast<float>(1 / axis.spacing), axis.nodes - 1,
          axis.nodes + 2};
}

VolumeParams MakeVolumeParams(const preprocess::LightVectorVolume& volume) {
  const auto& grid = volume.geometry.grid;
  const auto& lattice = volume.geometry.lattice;
  const lightfield::Vec2 centre = preprocess::SupportCentre(volume.geometry);
  VolumeParams params{};
  params.axis[0] = MakeVolumeAxis(volume.a_x);
  params.axis[1] = MakeVolumeAxis(volume.a_y);
  params.axis[2] = MakeVolumeAxis(volume.tau);
  params.centre[0] = static_cast<float>(centre.x);
  params.centre[1] = static_cast<float>(centre.y);
  params.extent[0] = static_cast<float>(centre.x - grid.u0_m);
  params.extent[1] = static_cast<float>(centre.y - grid.v0_m);
  params.image_low[0] = static_cast<float>(lattice.s0_m - centre.x);
  params.image_high[0] = static_cast<float>(lattice.s0_m + lattice.extent_s_m() - centre.x);
  params.image_low[1] = static_cast<float>(lattice.t1_m - lattice.extent_t_m() - centre.y);
  params.image_high[1] = static_cast<float>(lattice.t1_m - centre.y);
  return params;
}

// [channel][B0, B1_u, B1_v][tau][a_y][a_x], so that a vector takes neighbours in a_x: kernels read up to
// kVectorBeyond of them from the last one on.
Buffer UploadVolume(const Device& device, const preprocess::LightVectorVolume& volume) {
  constexpr std::size_t kVectorBeyond = 8;
  const std::size_t channels = volume.geometry.channels,
                    count = volume.coefficients.size() / 4 / channels;
  RequireRoom(device, "light-vector volume",
              (3 * channels * count + kVectorBeyond) * sizeof(float));
  core::UnsetVector<float> tables(3 * channels * count + kVectorBeyond);
  std::fill(tables.end() - kVectorBeyond, tables.end(), 0.0f);
  core::ParallelFor(channels * count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      for (int part = 0; part < 3; ++part)
        tables[(3 * (k / count) + part) * count + k % count] = volume.coefficients[4 * k + part];
  });
  return Buffer::From(device, std::span<const float>(tables));
}

// Summed-area tables of (width + 1) columns, rows padded to SatStride.
Buffer UploadSat(const Device& device, const char* what, std::span<const std::uint64_t> sat,
                 int table_width) {
  const std::size_t width = table_width + 1, stride = SatStride(table_width),
                    rows = sat.size() / width;
  RequireRoom(device, what, rows * stride * sizeof(std::uint64_t));
  core::UnsetVector<std::uint64_t> padded(rows * stride);
  core::ParallelFor(rows, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      std::fill_n(std::copy_n(sat.data() + row * width, width, padded.data() + row * stride),
                  stride - width, 0);
  });
  return Buffer::From(device, padded);
}

// 2^62 units of each table as a luminance.
Buffer UploadScale(const Device& device, const std::vector<int>& exponents) {
  std::vector<float> scale(exponents.size());
  for (std::size_t k = 0; k < scale.size(); ++k) scale[k] = std::ldexp(1.0f, 62 - exponents[k]);
  return Buffer::From(device, scale);
}

}  // namespace

LuminaireOnDevice::LuminaireOnDevice(const Device& device, const lightfield::LightField& field,
                                     const LuminaireTables& tables)
    : LuminaireOnDevice(device, field.geometry, [&](int m, std::span<float> planes) {
        std::copy_n(field.image(m, 0).data(), planes.size(), planes.data());
      }) {
  Add(device, tables);
}

LuminaireOnDevice::LuminaireOnDevice(const Device& device,
                                     const lightfield::LuminaireGeometry& geometry,
                                     const ImageSource& source)
    : geometry_(geometry), row_stride_(geometry.lattice.width + kRowPadding) {
  const auto width = static_cast<std::size_t>(geometry.lattice.width),
             stride = static_cast<std::size_t>(row_stride_);
  const std::size_t rows = static_cast<std::size_t>(geometry.lattice.height) * geometry.channels;
  const auto images = static_cast<std::size_t>(geometry.grid.count());
  RequireRoom(device, "images", images * ImageBytes(geometry));
  images_ = Buffer(device, images * ImageBytes(geometry));
  std::vector<float> image(rows * width), padded(rows * stride, 0.0f);
  for (std::size_t m = 0; m < images; ++m) {
    source(static_cast<int>(m), image);
    for (std::size_t row = 0; row < rows; ++row)
      std::copy_n(image.data() + row * width, width, padded.data() + row * stride);
    images_.Upload(std::span<const float>(padded), m * padded.size());
  }
}

lightfield::LightField LuminaireOnDevice::Download() const {
  lightfield::LightField field(geometry_);
  const auto width = static_cast<std::size_t>(geometry_.lattice.width),
             stride = static_cast<std::size_t>(row_stride_);
  const auto images = static_cast<std::size_t>(geometry_.grid.count());
  const std::size_t rows = field.data.size() / width / images;  // of an image's channels
  std::vector<float> padded(rows * stride);
  for (std::size_t m = 0; m < images; ++m) {
    images_.Download(std::span<float>(padded), m * padded.size());
    for (std::size_t row = 0; row < rows; ++row)
      std::copy_n(padded.data() + row * stride, width,
                  field.data.data() + (m * rows + row) * width);
  }
  return field;
}

std::vector<bool> LuminaireOnDevice::LitImages() const {
  const auto images = static_cast<std::size_t>(geometry_.grid.count());
  std::vector<float> padded(ImageBytes(geometry_) / sizeof(float));
  std::vector<bool> lit;
  for (std::size_t m = 0; m < images; ++m) {
    images_.Download(std::span<float>(padded), m * padded.size());
    lit.push_back(std::ranges::any_of(padded, [](float c) { return c != 0; }));
  }
  return lit;
}

void LuminaireOnDevice::Add(const Device& device, const LuminaireTables& tables) {
  if (tables.sat) {
    sat_ = UploadSat(device, "tables", tables.sat->sat, tables.sat->width);
    sat_scale_ = UploadScale(device, tables.sat->exponent);
  }
  if (tables.cells) {
    cell_sat_ = UploadSat(device, "cell tables", tables.cells->sat, tables.cells->width);
    cell_scale_ = UploadScale(device, tables.cells->exponent);
  }
  if (tables.volume) {
    const VolumeParams params = MakeVolumeParams(*tables.volume);
    volume_params_ = Buffer::From(device, std::span<const VolumeParams>(&params, 1));
    if (tables.volume->bytes() > 0) volume_ = UploadVolume(device, *tables.volume);
  }
  if (tables.patches) {
    const preprocess::PatchLight& patches = *tables.patches;
    RequireRoom(device, "patches' light", patches.light.size() * sizeof(float));
    patch_light_ = Buffer::From(device, patches.light);
    patch_axes_ = {patches.tau, patches.a_y, patches.a_x, {}};
    lit_patches_ = 0;
    for (int k = 0; k < preprocess::kPatches; ++k)
      lit_patches_ |= static_cast<std::uint32_t>(patches.IsLit(k)) << k;
  }
}

}  // namespace luxfield::render
