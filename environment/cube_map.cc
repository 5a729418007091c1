#include "luxfield/environment/cube_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/parallel.h"
#include "luxfield/environment/spherical_polygon.h"

namespace luxfield::environment {
namespace {

// A texel's corners in its face's own coordinates (right, up, axis), counter-clockwise in them.
// They mirror the world, which dot products and areas do not see.
std::array<lightfield::Vec3, 4> TexelCorners(int face_size, int row, int column) {
  const double step = 2.0 / face_size;
  const double x0 = -1 + step * column, x1 = -1 + step * (column + 1);
  const double y0 = 1 - step * (row + 1), y1 = 1 - step * row;
  return {{{x0, y0, 1}, {x1, y0, 1}, {x1, y1, 1}, {x0, y1, 1}}};
}

}  // namespace

CubePoint CubePointFromDirection(lightfield::Vec3 d) {
  const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
  const double largest = std::max({ax, ay, az});
  CubePoint p;
  if (ax == largest)
    p.face = d.x > 0 ? 0 : 1;
  else if (ay == largest)
    p.face = d.y > 0 ? 2 : 3;
  else
    p.face = d.z > 0 ? 4 : 5;
  p.x = lightfield::Dot(d, kCubeFaces[p.face].right) / largest;
  p.y = lightfield::Dot(d, kCubeFaces[p.face].up) / largest;
  return p;
}

double CubeRectangleSolidAngle(double x0, double x1, double y0, double y1) {
  const lightfield::Vec3 corners[] = {{x0, y0, 1}, {x1, y0, 1}, {x1, y1, 1}, {x0, y1, 1}};
  return PolygonSolidAngle(corners);
}

CubeMap::CubeMap(int face_size_)
    : face_size(face_size_), data(std::size_t{18} * face_size_ * face_size_, 0.0f) {}

std::size_t CubeMap::texel_of(lightfield::Vec3 direction) const {
  const CubePoint p = CubePointFromDirection(direction);
  const auto index = [this](double from_edge) {
    return std::clamp(static_cast<int>(0.5 * from_edge * face_size), 0, face_size - 1);
  };
  return texel(p.face, index(1 - p.y), index(1 + p.x));
}

std::vector<double> TexelSolidAngles(int face_size) {
  std::vector<double> angles;
  angles.reserve(std::size_t(face_size) * face_size);
  for (int row = 0; row < face_size; ++row)
    for (int column = 0; column < face_size; ++column)
      angles.push_back(PolygonSolidAngle(TexelCorners(face_size, row, column)));
  return angles;
}

core::Rgb MeanRadiance(const CubeMap& cube) {
  const std::vector<double> angles = TexelSolidAngles(cube.face_size);
  core::Rgb sum{};
  for (std::size_t t = 0; t < cube.texel_count(); ++t)
    for (std::size_t channel = 0; channel < 3; ++channel)
      sum[channel] += angles[t % angles.size()] * cube.data[3 * t + channel];
  for (double& value : sum) value /= 4 * std::numbers::pi;
  return sum;
}

core::Rgb Irradiance(const CubeMap& cube, lightfield::Vec3 n) {
  const int size = cube.face_size;
  std::array<lightfield::Vec3, 6> normals;  // n in the faces' frames
  for (std::size_t f = 0; f < 6; ++f)
    normals[f] = {lightfield::Dot(n, kCubeFaces[f].right), lightfield::Dot(n, kCubeFaces[f].up),
                  lightfield::Dot(n, kCubeFaces[f].axis)};
  std::vector<core::Rgb> rows(size);  // added up in their order: threads do not change the sum
  core::ParallelFor(size, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<lightfield::Vec3> above;
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      core::Rgb sum{};
      for (int column = 0; column < size; ++column) {
        const auto corners = TexelCorners(size, row, column);
        const lightfield::Vec3 whole = PolygonVectorIrradiance(corners);
        for (int f = 0; f < 6; ++f) {
          const lightfield::Vec3 normal = normals[f];
          int lit = 0;
          for (const lightfield::Vec3& corner : corners)
            lit += lightfield::Dot(normal, corner) >= 0;
          if (lit == 0) continue;
          lightfield::Vec3 vector = whole;
          if (lit < 4) {
            ClipByPlane(corners, normal, above);
            vector = PolygonVectorIrradiance(above);
          }
          const double cosine = lightfield::Dot(normal, vector);
          const float* radiance = &cube.data[3 * cube.texel(f, row, column)];
          for (std::size_t channel = 0; channel < 3; ++channel)
            sum[channel] += cosine * radiance[channel];
        }
      }
      rows[row] = sum;
    }
  });
  core::Rgb total{};
  for (const core::Rgb& row : rows)
    for (std::size_t channel = 0; channel < 3; ++channel) total[channel] += row[channel];
  return total;
}

}  // namespace luxfield::environment
