#include "lightfield/spherical_polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::lightfield {

double TriangleSolidAngle(Vec3 a, Vec3 b, Vec3 c) {
  const double triple = Dot(a, Cross(b - a, c - a));
  const double la = Length(a), lb = Length(b), lc = Length(c);
  return 2 * std::atan2(triple, la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb);
}

double PolygonSolidAngle(std::span<const Vec3> polygon) {
  double sum = 0;
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += TriangleSolidAngle(polygon[0], polygon[k - 1], polygon[k]);
  return sum;
}

Vec3 PolygonVectorIrradiance(std::span<const Vec3> polygon) {
  Vec3 sum;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = polygon[k], b = polygon[(k + 1) % polygon.size()];
    const Vec3 cross = Cross(a, b - a);
    const double sine = Length(cross);
    if (sine > 0) sum = sum + (0.5 * std::atan2(sine, Dot(a, b)) / sine) * cross;
  }
  return sum;
}

void ClipByPlane(std::span<const Vec3> polygon, Vec3 n, std::vector<Vec3>& clipped) {
  clipped.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = polygon[k], b = polygon[k + 1 == polygon.size() ? 0 : k + 1];
    const double da = Dot(n, a), db = Dot(n, b);
    if (da >= 0) clipped.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) clipped.push_back(a + (da / (da - db)) * (b - a));
  }
}

double CapOverlapSolidAngle(std::span<const Vec3> whole, Vec3 axis, double radius) {
  std::vector<Vec3> polygon;  // without the antipode of the axis, where azimuths end
  ClipByPlane(whole, axis, polygon);
  const double half_height = std::sin(0.5 * radius);
  const double sector = 2 * half_height * half_height;  // 1 - cos(radius)
  const auto outside = [&](Vec3 p, Vec3 q) {
    const double azimuth =
        std::atan2(Dot(axis, Cross(p, q)), Dot(p, q) - Dot(axis, p) * Dot(axis, q));
    return sector * azimuth;
  };
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = Normalized(polygon[k]), b = Normalized(polygon[(k + 1) % polygon.size()]);
    const Vec3 cross = Cross(a, b - a);
    const double sine = Length(cross);
    if (!(sine > 0)) continue;
    // Points of the edge's great circle by their angle from the one nearest to the axis; those
    // within `reach` of it lie in the cap.
    const Vec3 normal = (1 / sine) * cross;
    const double distance = Dot(axis, normal);
    const double inside_square = std::sin(radius) * std::sin(radius) - distance * distance;
    if (!(inside_square > 0)) {
      sum += outside(a, b);
      continue;
    }
    const double reach = std::atan2(std::sqrt(inside_square), std::cos(radius));
    const Vec3 foot = Normalized(axis - distance * normal), ahead = Cross(normal, foot);
    double from = std::atan2(Dot(a, ahead), Dot(a, foot));
    if (from > reach) from -= 2 * std::numbers::pi;  // such an edge meets the cap on its way round
    const double to = from + std::atan2(sine, Dot(a, b));
    const double enter = std::clamp(-reach, from, to), leave = std::clamp(reach, enter, to);
    const auto at = [&](double angle) { return std::cos(angle) * foot + std::sin(angle) * ahead; };
    const Vec3 p = at(enter), q = at(leave);
    if (enter > from) sum += outside(a, p);
    if (leave > enter) sum += TriangleSolidAngle(axis, p, q);
    if (leave < to) sum += outside(q, b);
  }
  return sum;
}

}  // namespace luxfield::lightfield
