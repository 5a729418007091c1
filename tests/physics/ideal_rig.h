// An ideal lab (no noise, no ADC, perfect prints) around a lamp that lies in the span of the basis,
// run through the whole chain.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/planning/chain.h"

namespace luxfield::physics {

// Lengths are in sensor pixels of kPixel_m on the image plane. A lattice texel is a whole number of
// pixels and every edge of the centred lattice is a pixel edge of a sensor on the axis, so that
// nothing but the filter's position decides whether pixels and texels are aligned.
struct IdealRig {
  static constexpr double kPixel_m = 0.004;

  std::string name;  // of the test; part of the folder
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  bool dual = false;
  double filter_scale = 1;
  int channels = 1;
  int grid_width = 6, grid_height = 5;
  double spacing_px = 4;
  int texel_px = 2;
  int lattice_width = 36, lattice_height = 32;
  // 72 + 5 * 4 by 64 + 4 * 4 pixels see every texel at every position.
  int sensor_width = 96, sensor_height = 84;
  // Pixels per kPixel_m along an axis; the sensor keeps its extent.
  int resolution = 1;
  // Reflector rig: where the corners (top left, top right, bottom right, bottom left) of the sensor
  // land, relative to half the extent of a sensor of kPixel_m pixels.
  std::optional<std::array<lightfield::Vec2, 4>> corners;
  double albedo = 0.8;

  lightfield::LuminaireGeometry Geometry() const;
};

// Non-negative images of more than five decades: in each a ragged hot spot of its own place, so
// that neighbouring texels and neighbouring images differ by large factors.
lightfield::LightField StructuredLamp(const IdealRig& rig, std::uint64_t seed);
// Images that do not vary over s; each its own value in [0.5, 1.5] c.
lightfield::LightField FlatLamp(const IdealRig& rig, double c, std::uint64_t seed);

struct IdealRun {
  std::filesystem::path truth_file, reconstructed_file;
  planning::ChainResult chain;
  // E_ij on the lattice, from the lab: [m][(channel * height + row) * width + column].
  std::vector<std::vector<float>> true_irradiance;
};

// Captures, merges and reconstructs `lamp` in a fresh folder under testing::TempDir(). Measured
// irradiance is divided by the print's scale, as files have it.
IdealRun RunIdeal(const IdealRig& rig, const lightfield::LightField& lamp);

}  // namespace luxfield::physics
