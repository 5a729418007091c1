#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "render/estimators/estimator.h"

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

}  // namespace

LuminaireOnDevice::LuminaireOnDevice(const Device& device, const lightfield::LightField& field,
                                     const LuminaireTables& tables)
    : geometry_(field.geometry), row_stride_(field.geometry.lattice.width + kRowPadding) {
  const std::size_t width = geometry_.lattice.width, rows = field.data.size() / width;
  RequireRoom(device, "images", rows * row_stride_ * sizeof(float));
  std::vector<float> padded(rows * row_stride_, 0.0f);
  core::ParallelFor(rows, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      std::copy_n(field.data.data() + row * width, width, padded.data() + row * row_stride_);
  });
  images_ = Buffer::From(device, padded);
  Add(device, tables);
}

void LuminaireOnDevice::Add(const Device& device, const LuminaireTables& tables) {
  if (tables.sat) {
    RequireRoom(device, "tables", tables.sat->sat.size() * sizeof(std::uint64_t));
    sat_ = Buffer::From(device, tables.sat->sat);
    std::vector<float> scale(tables.sat->exponent.size());
    for (std::size_t m = 0; m < scale.size(); ++m)
      scale[m] = std::ldexp(1.0f, 62 - tables.sat->exponent[m]);
    sat_scale_ = Buffer::From(device, scale);
  }
}

}  // namespace luxfield::render
