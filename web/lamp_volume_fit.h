// The lamp's volume of at most so many bytes, and how far it is from the closed form.
//
// The deviation of a receiver (p, n) is counted in
//
//   unit(p, n) = max(|E(p, n)|, 0.1 B(z)),   B(z) the brightest at its height (BrightestAt)
//
// so that a zone's stated error s says |E_volume - E| <= s unit of each of its receivers whose
// horizon does not cut the light. s is measured: 1.25 times the largest deviation that is found of J
// at 16 heights on a lattice over the whole footprint, and of E at random receivers, half of them
// anywhere in the footprint, half where it is bright, with normals up to 45 degrees off the lamp's
// axis.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/light_vector_volume.h"
#include "luxfield/web/lamp_volume.h"

namespace luxfield::web {

inline constexpr double kFloorShare = 0.1;     // of B(z)
inline constexpr double kStatedMargin = 1.25;  // for receivers that were not measured

// Receivers of one range of heights.
struct ErrorZone {
  double z_first_m = 0, z_last_m = 0;
  bool on_image_plane = false;  // the zone about I, where the texels of the images show
  double stated_error = 0;
  double rel_rmse = 0;  // docs/theory.md 10
  int receivers = 0;
};

struct FitOptions {
  double max_error = 0.005;            // the stated error that is enough
  std::size_t max_bytes = 680 * 1000;  // of the packed codes
  int receivers = 1000;                // measured in each zone
  std::uint64_t seed = 1;
};

struct FittedVolume {
  LampVolume volume;
  std::vector<std::vector<std::uint8_t>> packed;  // PackCodes of each table
  std::vector<ErrorZone> zones;                   // from the nearest to the farthest

  std::size_t packed_bytes() const;
  // The largest of the zones except that about I.
  double stated_error() const;
};

// The heights that the volume is stated for: from 2 cm, or 0.4 delta where that is less, to 20 m. The zone about
// I reaches 2 cm, or 0.1 delta, to either side.
double NearestHeight(double delta_m);
double HalfWidthAboutImagePlane(double delta_m);
inline constexpr double kFarthestHeight_m = 20;

// Receivers as stated above, log-uniform in z between two heights that the volume has tables for.
std::vector<preprocess::Receiver> LitReceivers(const lightfield::LightField& field,
                                               const LampVolume& volume, double z_first_m,
                                               double z_last_m, int count, std::uint64_t seed);

// Measures stated_error and rel_rmse of a zone with that many receivers.
void MeasureZone(const lightfield::LightField& field, const LampVolume& volume, int receivers,
                 std::uint64_t seed, ErrorZone& zone);

// Makes each table finer until it is as exact as asked for, or has its share of the bytes.
// InputError naming `name` if the light field is all zero.
FittedVolume FitLampVolume(const lightfield::LightField& field, const FitOptions& options,
                           const std::string& name);

}  // namespace luxfield::web
