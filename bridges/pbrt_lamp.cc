#include "luxfield/bridges/pbrt_lamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/version.h"

namespace luxfield::bridges {

using lightfield::Vec3;

Vec3 EqualAreaDirection(double x, double y) {
  const double ax = std::abs(x), ay = std::abs(y), s = 1 - ax - ay, r = 1 - std::abs(s);
  const double phi = std::numbers::pi / 4 * (r > 0 ? (ay - ax) / r + 1 : 1);
  const double across = r * std::sqrt(2 - r * r);
  return {std::copysign(std::cos(phi) * across, x), std::copysign(std::sin(phi) * across, y),
          std::copysign(1 - r * r, s)};
}

PbrtLamp WritePbrtLamp(const std::filesystem::path& path,
                       std::span<const lightfield::PosedLightField> fields,
                       const std::string& source) {
  constexpr int kSide = 1024;
  const auto luminance = formats::LuminanceOf(fields);
  const formats::Photometry table = formats::SampleFarField(luminance, {}, {}, source).table;
  core::Image picture(kSide, kSide, 1);
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      picture.data[static_cast<std::size_t>(row) * kSide + column] = static_cast<float>(
          std::max(0.0, Intensity(table, EqualAreaDirection((2 * column + 1.0) / kSide - 1,
                                                            (2 * row + 1.0) / kSide - 1))));
  PbrtLamp written;
  const std::string stem = path.stem().string();
  written.files = {path, path.parent_path() / (stem + ".exr")};
  core::WriteExrImage(written.files[1], picture);
  const auto flux = lightfield::TotalFlux(fields);
  const double whole = core::Luminance(flux);
  core::WriteFileAtomically(
      path, fmt::format("# {}, a measured lamp's far field, by luxfield " LUXFIELD_VERSION
                        ". It shines along +z.\n"
                        "LightSource \"goniometric\"\n"
                        "  \"string filename\" \"{}.exr\"\n"
                        "  \"rgb I\" [ {:.6g} {:.6g} {:.6g} ]\n",
                        stem, stem, flux[0] / whole, flux[1] / whole, flux[2] / whole));
  written.deviations = DeviationsOf(luminance, [&](Vec3 p, Vec3 n) {
    const double r = Length(p);
    return Intensity(table, p) * std::max(0.0, -Dot(p, n) / r) / (r * r);
  });
  return written;
}

}  // namespace luxfield::bridges
