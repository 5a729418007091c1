// The light-vector volume: the irradiance of a whole luminaire in one small 3-D table
// (docs/theory.md 7.2).
//
//   J(p) = delta^2 / z^3 (B1_u - p_x B0, B1_v - p_y B0, -z B0),   z = p_z = delta + D
//   B0(a, tau) = sum_m integral_F C_m(s(u)) Phi_m(u) du,   B1 the same times u,
//   tau = delta / z,   a = tau p_xy,   s(u) = a + (1 - tau) u
//
// with u, p_xy and a counted from the centre of the supports on F (s from the point of I in front
// of it), so that B1 keeps its digits for a grid that lies off the axis. B0 and B1 are regular for
// every tau: far away (tau = 0), on I (tau = 1) and between the planes (tau > 1). They get as rough
// as the images where the windows on I shrink to texels, at |1 - tau| h below a texel: there the
// closed form itself is cheap, and MaxTau leaves such receivers to it.
//
// Between the nodes B0 and B1 are tricubic splines with not-a-knot ends (de Boor 1978): two more
// coefficients than nodes per axis and no nodes beyond the reach. The error falls with the fourth
// power of the spacing where the images are smooth, with the third where they are not, since
// bspline2 over texels has a discontinuous third derivative.
//
// Precision: texel weights in double, rounded to float32; sums over at most 32 rows of a window in
// float32, all others in double; nodes and spline coefficients are float32. Together below 2e-6 of
// the largest |J| in the stencil, three orders below the errors of interpolation asked for here.
//
// Work: two separable passes per slice of tau. Rows first: 2 products per image, node row, texel
// row of the window and texel column; then 3 per node, basis column and texel column of the
// window. Bytes: 16 per coefficient and channel.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/field_columns.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::preprocess {

struct Interval {  // empty until widened
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();

  void Widen(double x) { lo = std::min(lo, x), hi = std::max(hi, x); }
};

// The part of (a_x, a_y, tau) that receivers reach; a in metres.
struct Reach {
  Interval a_x_m, a_y_m, tau;

  bool empty() const { return !(tau.lo <= tau.hi); }
};

// The middle of the supports on F: what u, a and p_xy are counted from.
lightfield::Vec2 SupportCentre(const lightfield::LuminaireGeometry& geometry);

struct VolumeCoordinates {
  double a_x_m = 0, a_y_m = 0, tau = 0;
};

// Of p with p.z > 0, luminaire frame.
VolumeCoordinates CoordinatesOf(const lightfield::LuminaireGeometry& geometry, lightfield::Vec3 p);

// False if every window of p misses the images, so that J(p) = 0; also for p.z <= 0.
bool SeesImages(const lightfield::LuminaireGeometry& geometry, lightfield::Vec3 p);

// 1 - texel / h, at least 1/2: up to here a basis function's window is at least n texels wide.
double MaxTau(const lightfield::LuminaireGeometry& geometry);

// A surface point in the luminaire's frame: position in metres, unit normal towards the lamp side.
struct Receiver {
  lightfield::Vec3 p, n;
};

// True if n . J(p) is the irradiance of the receiver and tau <= max_tau: a volume may light it. Of
// the others those that see no image are dark; the rest is the closed form's.
bool VolumeLights(const lightfield::LuminaireGeometry& geometry, const Receiver& receiver,
                  double max_tau);

// The smallest reach that holds every receiver that VolumeLights. a and tau are projective in p, so
// the reach of a triangle in front of F is that of its corners. Empty if there is no such receiver.
Reach ReachOf(const lightfield::LuminaireGeometry& geometry, std::span<const Receiver> receivers,
              double max_tau);

// Every axis widened to at least h / 10, or 0.01 in tau, so that spacings stay above rounding.
Reach WidenNarrowAxes(const lightfield::LuminaireGeometry& geometry, const Reach& reach);

// Node k = 0 .. nodes - 1 at first + k spacing; spline coefficient k = 0 .. nodes + 1 belongs to
// node k - 1.
struct VolumeAxis {
  double first = 0, spacing = 0;
  int nodes = 0;

  std::size_t coefficients() const { return nodes == 0 ? 0 : static_cast<std::size_t>(nodes) + 2; }
};

// Nodes per axis, each at least 4.
struct VolumeResolution {
  int a_x = 4, a_y = 4, tau = 4;
};

struct LightVectorVolume {
  lightfield::LuminaireGeometry geometry;  // of the light field it was made from
  VolumeAxis tau, a_y, a_x;
  // float4 (B0, B1_u, B1_v, 0) per coefficient: [channel][tau][a_y][a_x][4]. W sr^-1 m^-2, and the
  // same times m.
  std::vector<float> coefficients;

  std::size_t bytes() const { return coefficients.size() * sizeof(float); }
  // Inside the nodes' range, where nothing is extrapolated.
  bool Covers(const VolumeCoordinates& at) const;
};

// Bytes of a volume of that resolution.
std::size_t VolumeBytes(const VolumeResolution& resolution, int channels);

// (B0, B1_u, B1_v, 0) for one tau >= 0 at every a_x (ascending) and a_y, metres: float4
// [channel][a_y][a_x][4] with a border of zeros around each channel, where a spline through these
// nodes has its outermost coefficients.
std::vector<float> TabulateMoments(const lightfield::LightField& field, std::span<const double> a_x,
                                   std::span<const double> a_y, double tau);

// Tabulates `field` over `reach`, its narrow axes widened. An empty reach gives a volume without
// nodes that covers nothing. C of any sign. InputError if the resolution is below 4 or a
// coefficient is not finite. Groups of columns make the same volume, to the bit, as all at once, in
// a pass over them; it takes 2.5 times the volume's bytes.
LightVectorVolume BuildLightVectorVolume(const lightfield::FieldColumns& field, const Reach& reach,
                                         const VolumeResolution& resolution);

// J(p) from the volume in double arithmetic; none where the volume does not cover p. Zero where p
// sees no image.
std::optional<lightfield::LightVector> InterpolateLightVector(const LightVectorVolume& volume,
                                                              lightfield::Vec3 p);

// RMSE over the mean of the irradiance in closed form, the relative RMSE of docs/theory.md 10, all
// channels: the larger of that over all receivers that see light, of which those that the volume
// does not cover or whose horizon cuts the supports are the closed form's and right, and of that
// over the others. 0 if there are none.
double VolumeError(const LightVectorVolume& volume, const lightfield::FieldColumns& field,
                   std::span<const Receiver> receivers);

// At most `count` receivers facing F whose (a, tau) are uniform in the part of the reach that sees
// the images.
std::vector<Receiver> RandomReceivers(const lightfield::LuminaireGeometry& geometry,
                                      const Reach& reach, std::size_t count, std::uint64_t seed);

struct VolumeOptions {
  double max_rel_error = 2e-3;  // of VolumeError
  std::size_t max_bytes = std::size_t{256} << 20;
};

// A receiver that sees light, and its irradiance in closed form per channel.
struct JudgedReceiver {
  Receiver receiver;
  bool by_volume = false;  // n . J is the irradiance
  std::array<double, 3> irradiance{};
};

struct VolumeForError {
  LightVectorVolume volume;
  std::vector<JudgedReceiver> judges;  // that see light, of those given
  double rel_error = 0;                // VolumeError at the receivers given; 0 if none is covered
  bool met = false;                    // false: max_bytes came first
  // Of the volume that would have been built next, larger than max_bytes; 0: none would have been.
  std::size_t wanted_bytes = 0;
  int builds = 0;
};

// The volume over `reach` whose error at `receivers` is at most the one asked for. Starts from a
// spacing of h, measures, tells the axes' shares apart by leaving out every second node of one
// axis, and builds again at the spacings that the orders of the error predict, until the target is
// met or the next volume would exceed `max_bytes`. The receivers should be a sample of those to be
// lit (some hundred): what is bright there counts. Besides, no receiver of `spread` should be off by
// more than 3 max_rel_error times the sum of its irradiance and the mean: where one is, finer
// volumes are built, two at most, bytes allowing. What it is judged by, and each build, take a pass
// over the groups of columns. InputError for options that make no sense.
VolumeForError BuildForError(const lightfield::FieldColumns& field, const Reach& reach,
                             std::span<const Receiver> receivers, const VolumeOptions& options = {},
                             std::span<const Receiver> spread = {});

// The same over the reach of `receivers` with tau <= MaxTau, judged by `sample` at random of those
// that see the images, and by twice as many that are spread evenly over tau, so that what is near the lamp
// counts although it fills few pixels. An empty volume, met, if a volume would light none of the
// sample.
VolumeForError BuildForReceivers(const lightfield::FieldColumns& field,
                                 std::span<const Receiver> receivers,
                                 const VolumeOptions& options = {}, std::size_t sample = 1500,
                                 std::uint64_t seed = 1);

}  // namespace luxfield::preprocess
