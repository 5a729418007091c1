// Radiance from infinitely far, as a cube map (docs/theory.md 8).
//
// World frame: right-handed, z up. Faces in the order +x, -x, +y, -y, +z, -z. Each face is seen
// from inside the cube: x in [-1, 1] runs along its `right`, y in [-1, 1] along its `up`, and
//
//   w = (axis + x right + y up) / sqrt(1 + x^2 + y^2),   right = axis x up.
//
// The four side faces have world z up; +z has -y up and -z has +y up, so that both have x to the
// right. Texel (row, column) of a face with N x N texels covers x from -1 + 2 column / N, y
// from 1 - 2 row / N downwards, 2 / N each: row 0 is on top. Radiance is constant within a texel.
#pragma once

#include <array>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

struct CubeFace {
  lightfield::Vec3 axis, right, up;
};

inline constexpr std::array<CubeFace, 6> kCubeFaces = {{{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
                                                        {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                                        {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
                                                        {{0, -1, 0}, {-1, 0, 0}, {0, 0, 1}},
                                                        {{0, 0, 1}, {1, 0, 0}, {0, -1, 0}},
                                                        {{0, 0, -1}, {1, 0, 0}, {0, 1, 0}}}};

// A point of the cube's surface.
struct CubePoint {
  int face = 0;
  double x = 0, y = 0;
};

// axis + x right + y up: not of unit length.
inline lightfield::Vec3 CubeVector(CubePoint p) {
  const CubeFace& face = kCubeFaces[p.face];
  return face.axis + p.x * face.right + p.y * face.up;
}

// Where the direction leaves the cube; of any positive length. On an edge of the cube the face with
// the lower number.
CubePoint CubePointFromDirection(lightfield::Vec3 direction);

// dw / (dx dy) = (1 + x^2 + y^2)^(-3/2), sr.
inline double CubeSolidAnglePerArea(double x, double y) {
  const double square = 1 + x * x + y * y;
  return 1 / (square * std::sqrt(square));
}

// Solid angle, sr, of the rectangle [x0, x1] x [y0, y1] of a face,
//
//   S(x1, y1) - S(x0, y1) - S(x1, y0) + S(x0, y0),   S = atan2(xy, sqrt(1 + x^2 + y^2)),
//
// evaluated as two triangles, which has 1e-13 relative error for any texel where the differences of
// S have 1e-16 absolute.
double CubeRectangleSolidAngle(double x0, double x1, double y0, double y1);

struct CubeMap {
  int face_size = 0;  // N
  std::vector<float>
      data;  // RGB of face, row, column: data[((face N + row) N + column) 3 + channel]

  CubeMap() = default;
  explicit CubeMap(int face_size_);

  std::size_t texel_count() const { return std::size_t{6} * face_size * face_size; }
  std::size_t texel(int face, int row, int column) const {
    return (std::size_t(face) * face_size + row) * face_size + column;
  }
  float& at(int face, int row, int column, int channel) {
    return data[texel(face, row, column) * 3 + channel];
  }
  float at(int face, int row, int column, int channel) const {
    return data[texel(face, row, column) * 3 + channel];
  }
  // Texel that a direction falls into.
  std::size_t texel_of(lightfield::Vec3 direction) const;
};

// Solid angles of the N x N texels of any face, row-major, sr; six times their sum is 4 pi.
std::vector<double> TexelSolidAngles(int face_size);

// integral of L dw / (4 pi), per channel, sums in double.
core::Rgb MeanRadiance(const CubeMap& cube);

// E(n) = integral of L (n . w)+ dw, per channel, of a surface with unit normal n: exact for the
// piecewise constant map (texels on the horizon are clipped against it), sums in double. 6 N^2
// texels of some 20 ns each.
core::Rgb Irradiance(const CubeMap& cube, lightfield::Vec3 n);

}  // namespace luxfield::environment
