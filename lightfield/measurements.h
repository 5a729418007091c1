// *.meas.exr: irradiance on I behind each filter, registered on the luminaire's lattice
// (docs/theory.md 3).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

// Bits of the mask; 0 = a good value.
enum MeasurementFlag : std::uint32_t {
  kOffSensor = 1,      // s - c_ij fell off the sensor: unknown, not zero
  kSaturated = 2,      // saturated in every exposure
  kTooDark = 4,        // not detected (below): an estimate for solves, no number to report
  kDefect = 8,         // mostly hot or dead pixels
  kPartlyDefect = 16,  // less than half of it hot or dead: the value is the mean of the rest, and
                       // sigma holds what the rest says about the gap
  kBelowBlack = 32,    // far below the camera's black level, or so near 0 DN in every exposure that
                       // doesn't saturate that the ADC clips the noise: unknown
};
// Values under kOffSensor, kSaturated, kDefect or kBelowBlack are unknown (stored as 0) and must
// not enter a solve.
constexpr std::uint32_t kUnknownMask = kOffSensor | kSaturated | kDefect | kBelowBlack;

// A value within 3 of its standard deviations of 0 is not detected: one photon, or none, is
// nobody's measured number. 0.27 % of texels without light are detected by chance. Its estimate is
// kept apart in the file, for solves: dropping what is dark by chance, or putting 0 for it, would
// bias every mean over dark places, and with it C (`bench exposures`, case `one photon`).
constexpr float kDetectionSigmas = 3;
constexpr bool IsDetected(float value, float sigma) {
  return (value < 0 ? -value : value) >= kDetectionSigmas * sigma;
}

// One filter position: planar [channel][row][column] on geometry.lattice. E in W m^-2 (or lm m^-2,
// or relative).
struct Measurement {
  std::vector<float> irradiance;  // detected or not
  std::vector<float> sigma;       // standard deviation of irradiance
  std::vector<float> count;  // effective number of exposures that entered, per pixel [row][column]
  std::vector<std::uint32_t> mask;  // MeasurementFlag bits, per pixel [row][column] (any channel)
  // Where the filter's centre was, by the stage's read-back, minus the grid's centre(i, j). The
  // images are registered already; the displacement changes what part of F was seen.
  Vec2 displacement_m{};
};

// What filter made the images: `basis` prints (Phi itself), or `dual` pairs already combined to
// signed E.
enum class FilterKind { kBasis, kDual };

struct Measurements {
  LuminaireGeometry geometry;
  FilterKind filter = FilterKind::kBasis;
  double filter_scale = 1;  // the print's transmittance is filter_scale * Phi (16/9 lets a bspline2
                            // print peak at 1); irradiance is stored already divided by it
  Provenance provenance;
  std::vector<Measurement> positions;  // m = j * W + i
};

void WriteMeasurements(const std::filesystem::path& path, const Measurements& measurements);
// The same, one position in memory at a time: the positions of `header` have nothing but their
// displacement, and next(m), called once for each m in order, returns the rest. What it throws is
// passed on, and no file is left.
void WriteMeasurements(const std::filesystem::path& path, const Measurements& header,
                       const std::function<Measurement(int m)>& next);
// The same of the positions first to last - 1 alone: a file of their parts. Those of all positions,
// one file's after the other's, are the parts of the whole.
void WriteMeasurementPositions(const std::filesystem::path& path, const Measurements& header,
                               int first, int last, const std::function<Measurement(int m)>& next);
Measurements ReadMeasurements(const std::filesystem::path& path);
// The geometry alone.
LuminaireGeometry ReadMeasurementGeometry(const std::filesystem::path& path);
// Rows first to first + count - 1 of the images, as measurements on the lattice of these rows; reads
// no others. Throws InputError where the file has no such rows.
Measurements ReadMeasurementRows(const std::filesystem::path& path, int first, int count);

}  // namespace luxfield::lightfield
