// The light of a whole luminaire in small 3-D tables that a web page can hold (docs/web.md).
//
// With tau = delta / z and zeta = z / delta, the light vector J(p) of docs/theory.md 7 is
//
//   J(p) = tau^2 K(q, tau)   in front of I, z >= delta
//   J(p) = K(q, zeta)        between F and I, z < delta
//
// K is regular up to tau = 0, infinitely far away, where it is the far field. Let the rectangle with
// middle m_F and half sides h_F hold all light on F, and m_I, h_I all light on I. The light through
// p reaches I within its rectangle only where, per axis,
//
//   q = (tau p - m_I + (1 - tau) m_F) / (h_I + (1 - tau) h_F)                in front of I
//   q = (p - zeta m_I - (1 - zeta) m_F) / (zeta h_I + (1 - zeta) h_F)        between the planes
//
// lies in [-1, 1]: a box holds every receiver that sees light, at any distance. A table holds K over
// a range of tau or zeta as a tricubic spline with uniform nodes and not-a-knot ends.
//
// Coefficients are whole numbers of 12 bits, spread so that steps grow with the value:
//
//   coefficient = knee sinh(step code),   |code| <= 2047
//
// knee is 1e-2 of the table's largest |K_z|. Rounding changes a coefficient far above the knee by at
// most half a step, 0.13 % of it, and the spline averages over 64 of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::web {

// Middle and half sides of a rectangle on F or I, metres, luminaire's frame.
struct Rectangle {
  lightfield::Vec2 middle, half;
};

// What holds light: the supports of the images that are not all zero, and their texels that are not.
struct LightBounds {
  Rectangle on_f, on_i;
};

// InputError naming `name` if all of C is zero.
LightBounds BoundsOfLight(const lightfield::LightField& field, const std::string& name);

enum class Side { kFront, kBetween };

// Nodes per axis, each at least 4; w is tau in front of I, zeta between the planes.
struct TableSize {
  int x = 4, y = 4, w = 4;

  std::size_t coefficients() const { return static_cast<std::size_t>(x + 2) * (y + 2) * (w + 2); }
};

// Codes of all tables of a lamp: readers refuse more (docs/web.md, "The codes").
constexpr std::size_t kMostCodes = std::size_t{1} << 23;

// Of one component of K and one channel.
struct Quantisation {
  double knee = 1;  // W m^-2 or lm m^-2
  double step = 0;
};

struct LampTable {
  Side side = Side::kFront;
  double w_first = 0, w_last = 1;
  TableSize size;
  std::vector<Quantisation> quantisation;  // [channel][component]
  std::vector<std::int16_t> codes;         // [channel][component][w][y][x], x fastest
  std::vector<float> coefficients;         // what the codes stand for
  // The longest coefficient (K_x, K_y, K_z) of each slice of the spline, as luminance weighs the
  // channels: [w].
  std::vector<double> brightest;
};

struct LampVolume {
  double delta_m = 0;
  int channels = 1;
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  LightBounds bounds;
  std::vector<LampTable> tables;  // whose ranges join, from the nearest to infinitely far

  double nearest_z_m() const { return tables.front().w_first * delta_m; }
};

// A volume without tables. InputError naming `name` if all of C is zero.
LampVolume EmptyLampVolume(const lightfield::LightField& field, const std::string& name);

// A table of the volume's light field. C of any sign. InputError naming `name` if what it holds is
// not finite.
LampTable BuildLampTable(const lightfield::LightField& field, const LampVolume& volume, Side side,
                         double w_first, double w_last, const TableSize& size,
                         const std::string& name);

// K in closed form for one w at every q_x (ascending) and q_y: [y][x][channel][component].
std::vector<float> ExactSlice(const lightfield::LightField& field, const LightBounds& bounds,
                              Side side, double w, std::span<const double> q_x,
                              std::span<const double> q_y);

// The coefficients that a table's codes stand for, and the brightest of its slices.
void FillFromCodes(LampTable& table, int channels);

// The point with that q at height z > 0.
lightfield::Vec3 PointAt(const LampVolume& volume, lightfield::Vec2 q, double z_m);

// The table for a receiver at that height; none nearer than nearest_z_m.
const LampTable* TableAt(const LampVolume& volume, double z_m);

// J(p) by the tables, double arithmetic; zero where no light comes, and for z < nearest_z_m.
lightfield::LightVector LightVectorAt(const LampVolume& volume, lightfield::Vec3 p);

// Where the rectangle with all light on F lies to the horizon of a receiver: n . (u - p) >= 0 is
// before it.
enum class Horizon { kBefore, kCut, kBehind };
Horizon HorizonOf(const LampVolume& volume, lightfield::Vec3 p, lightfield::Vec3 n);

// The illuminance by J, as luminance weighs the channels (core/colour.h): n . J before the horizon,
// where it is below 0 if C is; 0 behind it; and where it cuts the light an estimate, n . J, but at
// least 0.
double IlluminanceAt(const LampVolume& volume, lightfield::Vec3 p, lightfield::Vec3 n);

// About the largest illuminance at that height: by the brightest of the slice that is nearest.
double BrightestAt(const LampVolume& volume, double z_m);

// The codes as bytes and back (docs/web.md, "The codes"): differences to what neighbours predict,
// low bytes before high bytes, compressed by zlib.
std::vector<std::uint8_t> PackCodes(const LampTable& table, int channels);
// InputError if the bytes are no codes of that many.
std::vector<std::int16_t> UnpackCodes(const std::vector<std::uint8_t>& bytes, const TableSize& size,
                                      int channels);

}  // namespace luxfield::web
