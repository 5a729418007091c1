#include "luxfield/environment/spherical_polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::environment {

double TriangleSolidAngle(lightfield::Vec3 a, lightfield::Vec3 b, lightfield::Vec3 c) {
  const double triple = lightfield::Dot(a, lightfield::Cross(b - a, c - a));
  const double la = lightfield::Length(a), lb = lightfield::Length(b), lc = lightfield::Length(c);
  return 2 * std::atan2(triple, la * lb * lc + lightfield::Dot(a, b) * lc +
                                    lightfield::Dot(b, c) * la + lightfield::Dot(c, a) * lb);
}

double PolygonSolidAngle(std::span<const lightfield::Vec3> polygon) {
  double sum = 0;
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += TriangleSolidAngle(polygon[0], polygon[k - 1], polygon[k]);
  return sum;
}

lightfield::Vec3 PolygonVectorIrradiance(std::span<const lightfield::Vec3> polygon) {
  lightfield::Vec3 sum;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const lightfield::Vec3 a = polygon[k], b = polygon[(k + 1) % polygon.size()];
    const lightfield::Vec3 cross = lightfield::Cross(a, b - a);
    const double sine = lightfield::Length(cross);
    if (sine > 0) sum = sum + (0.5 * std::atan2(sine, lightfield::Dot(a, b)) / sine) * cross;
  }
  return sum;
}

void ClipByPlane(std::span<const lightfield::Vec3> polygon, lightfield::Vec3 n,
                 std::vector<lightfield::Vec3>& clipped) {
  clipped.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const lightfield::Vec3 a = polygon[k], b = polygon[k + 1 == polygon.size() ? 0 : k + 1];
    const double da = lightfield::Dot(n, a), db = lightfield::Dot(n, b);
    if (da >= 0) clipped.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) clipped.push_back(a + (da / (da - db)) * (b - a));
  }
}

double CapOverlapSolidAngle(std::span<const lightfield::Vec3> whole, lightfield::Vec3 axis,
                            double radius) {
  std::vector<lightfield::Vec3> polygon;  // without the antipode of the axis, where azimuths end
  ClipByPlane(whole, axis, polygon);
  const double half_height = std::sin(0.5 * radius);
  const double sector = 2 * half_height * half_height;  // 1 - cos(radius)
  const auto outside = [&](lightfield::Vec3 p, lightfield::Vec3 q) {
    const double azimuth =
        std::atan2(lightfield::Dot(axis, lightfield::Cross(p, q)),
                   lightfield::Dot(p, q) - lightfield::Dot(axis, p) * Dot(axis, q));
    return sector * azimuth;
  };
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const lightfield::Vec3 a = lightfield::Normalized(polygon[k]),
                           b = lightfield::Normalized(polygon[(k + 1) % polygon.size()]);
    const lightfield::Vec3 cross = lightfield::Cross(a, b - a);
    const double sine = lightfield::Length(cross);
    if (!(sine > 0)) continue;
    // Points of the edge's great circle by their angle from the one nearest to the axis; those
    // within `reach` of it lie in the cap.
    const lightfield::Vec3 normal = (1 / sine) * cross;
    const double distance = lightfield::Dot(axis, normal);
    const double inside_square = std::sin(radius) * std::sin(radius) - distance * distance;
    if (!(inside_square > 0)) {
      sum += outside(a, b);
      continue;
    }
    const double reach = std::atan2(std::sqrt(inside_square), std::cos(radius));
    const lightfield::Vec3 foot = lightfield::Normalized(axis - distance * normal),
                           ahead = lightfield::Cross(normal, foot);
    double from = std::atan2(lightfield::Dot(a, ahead), lightfield::Dot(a, foot));
    if (from > reach) from -= 2 * std::numbers::pi;  // such an edge meets the cap on its way round
    const double to = from + std::atan2(sine, lightfield::Dot(a, b));
    const double enter = std::clamp(-reach, from, to), leave = std::clamp(reach, enter, to);
    const auto at = [&](double angle) { return std::cos(angle) * foot + std::sin(angle) * ahead; };
    const lightfield::Vec3 p = at(enter), q = at(leave);
    if (enter > from) sum += outside(a, p);
    if (leave > enter) sum += TriangleSolidAngle(axis, p, q);
    if (leave < to) sum += outside(q, b);
  }
  return sum;
}

}  // namespace luxfield::environment
