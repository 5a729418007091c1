// The two planes of a luminaire and the lattices on them (docs/theory.md 1;
// docs/formats/light-field.md).
//
// Luminaire frame: right-handed, metres. Filter plane F is z = 0, image plane I is z = delta. Light
// travels towards +z. A ray runs from u = (u, v) on F through s = (s, t) on I.
#pragma once

#include <array>
#include <cmath>

namespace luxfield::lightfield {

struct Vec2 {
  double x = 0, y = 0;
};

struct Vec3 {
  double x = 0, y = 0, z = 0;
};

inline Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2 operator*(double k, Vec2 a) { return {k * a.x, k * a.y}; }
inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(double k, Vec3 a) { return {k * a.x, k * a.y, k * a.z}; }
inline double Dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 Cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double Length(Vec3 a) { return std::sqrt(Dot(a, a)); }
inline Vec3 Normalized(Vec3 a) { return (1 / Length(a)) * a; }

// A pixel lattice on a plane: column c is centred on s = s0 + (c + 0.5) ds, row r on
// t = t1 - (r + 0.5) dt; row 0 is on top seen from the receivers. s0 and t1 are outer edges.
// Metres.
struct Lattice {
  int width = 0, height = 0;
  double s0_m = 0, t1_m = 0;
  double ds_m = 0, dt_m = 0;

  double s_of_column(double column_edge) const { return s0_m + column_edge * ds_m; }
  double t_of_row(double row_edge) const { return t1_m - row_edge * dt_m; }
  double column_of_s(double s_m) const { return (s_m - s0_m) / ds_m; }
  double row_of_t(double t_m) const { return (t1_m - t_m) / dt_m; }
  Vec2 centre(int row, int column) const {
    return {s_of_column(column + 0.5), t_of_row(row + 0.5)};
  }
  double texel_area_m2() const { return ds_m * dt_m; }
  // width and height of the whole lattice
  double extent_s_m() const { return width * ds_m; }
  double extent_t_m() const { return height * dt_m; }

  bool operator==(const Lattice&) const = default;
};

// cos(theta) of the ray u -> s to +z (docs/theory.md 1): delta / sqrt(delta^2 + |u - s|^2).
inline double CosTheta(double delta_m, Vec2 u, Vec2 s) {
  const double dx = s.x - u.x, dy = s.y - u.y;
  return delta_m / std::sqrt(delta_m * delta_m + dx * dx + dy * dy);
}

}  // namespace luxfield::lightfield
