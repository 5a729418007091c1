#include "lightfield/spherical_polygon.h"

#include <cmath>

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

}  // namespace luxfield::lightfield
