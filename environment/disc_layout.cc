#include "luxfield/environment/disc_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/lightfield/quadrature.h"

namespace luxfield::environment {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr lightfield::Vec3 kForward = {0, -1, 0}, kRight = {-1, 0, 0}, kUp = {0, 0, 1};

constexpr Disc kAngularMap = {kForward, kRight, kUp, false, kPi};
constexpr Disc kMirrorBall = {{0, 1, 0}, kRight, kUp, true, kPi};
constexpr Disc kFisheye = {kUp, kRight, {0, 1, 0}, false, kPi / 2};

// sin(x) / x
double Sinc(double x) { return std::abs(x) < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x; }

}  // namespace

const Disc* FindDisc(EnvironmentLayout layout) {
  switch (layout) {
    case EnvironmentLayout::kAngularMap:
      return &kAngularMap;
    case EnvironmentLayout::kMirrorBall:
      return &kMirrorBall;
    case EnvironmentLayout::kFisheyeHemisphere:
      return &kFisheye;
    case EnvironmentLayout::kLatitudeLongitude:
    case EnvironmentLayout::kCube:
      break;
  }
  return nullptr;
}

PictureToDirection Disc::At(lightfield::Vec2 q) const {
  const double r = std::min(1.0, std::hypot(q.x, q.y));
  if (is_mirror) {
    const double slope = 2 * std::sqrt(std::max(0.0, 1 - r * r));  // sin(2 asin r) / r
    return {(1 - 2 * r * r) * axis + (slope * q.x) * right + (slope * q.y) * up, 16};
  }
  const double sinc = Sinc(rim * r);
  const double slope = rim * sinc;
  return {std::cos(rim * r) * axis + (slope * q.x) * right + (slope * q.y) * up,
          4 * rim * rim * sinc};
}

std::optional<lightfield::Vec2> Disc::Find(lightfield::Vec3 w) const {
  const double x = lightfield::Dot(w, right), y = lightfield::Dot(w, up), sine = std::hypot(x, y);
  const double theta = std::atan2(sine, lightfield::Dot(w, axis));
  const double r = is_mirror ? std::sin(0.5 * theta) : theta / rim;
  if (r > 1) return {};
  // Straight behind the axis the whole rim shows the direction: its rightmost point stands for it.
  if (sine == 0) return lightfield::Vec2{r, 0};
  return lightfield::Vec2{r * x / sine, r * y / sine};
}

double Disc::HeightPerSquare(double r) const {
  if (is_mirror) return 2;
  const double sinc = Sinc(0.5 * rim * r);
  return 0.5 * rim * rim * sinc * sinc;
}

double Disc::SolidAngle(lightfield::Vec2 low, lightfield::Vec2 high) const {
  const double rim_height = HeightPerSquare(1);
  double sum = 0;
  for (const DiscPiece& piece : ClipToDisc(low, high)) {
    if (piece.is_arc) {
      sum += rim_height * piece.angle;
      continue;
    }
    const lightfield::Vec2 step = piece.to - piece.from;
    // Gauss3 on pieces of this length leaves 1e-15.
    const int pieces = 1 + static_cast<int>(128 * std::hypot(step.x, step.y));
    const double moment = piece.from.x * step.y - piece.from.y * step.x;
    for (int k = 0; k < pieces; ++k)
      sum += moment * lightfield::Gauss3(double(k) / pieces, double(k + 1) / pieces, [&](double t) {
               const lightfield::Vec2 q = piece.from + t * step;
               return HeightPerSquare(std::hypot(q.x, q.y));
             });
  }
  return sum;
}

std::vector<DiscPiece> ClipToDisc(lightfield::Vec2 low, lightfield::Vec2 high) {
  const std::array<lightfield::Vec2, 4> corners = {
      {{low.x, low.y}, {high.x, low.y}, {high.x, high.y}, {low.x, high.y}}};
  const auto inside = [](lightfield::Vec2 q) { return q.x * q.x + q.y * q.y <= 1; };
  std::vector<DiscPiece> lines;
  for (std::size_t k = 0; k < 4; ++k) {
    const lightfield::Vec2 from = corners[k], to = corners[(k + 1) % 4], step = to - from;
    if (inside(from) && inside(to)) {
      lines.push_back({from, to});
      continue;
    }
    // |from + t step| = 1. The line is an edge along an axis: the nearest point and half the chord.
    const double length = std::abs(step.x + step.y);
    const lightfield::Vec2 along = (1 / length) * step;
    const double foot = -(from.x * along.x + from.y * along.y);
    const double distance = from.x * along.y - from.y * along.x;
    if (distance * distance >= 1) continue;
    const double half = std::sqrt(1 - distance * distance);
    const double t0 = std::max(0.0, foot - half), t1 = std::min(length, foot + half);
    if (t0 < t1) lines.push_back({from + t0 * along, from + t1 * along});
  }
  if (lines.empty()) {
    const bool whole = low.x <= -1 && high.x >= 1 && low.y <= -1 && high.y >= 1;
    if (!whole) return {};
    return {{{1, 0}, {1, 0}, true, 2 * kPi}};
  }
  std::vector<DiscPiece> border;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    border.push_back(lines[k]);
    const lightfield::Vec2 from = lines[k].to, to = lines[(k + 1) % lines.size()].from;
    if (std::abs(from.x - to.x) + std::abs(from.y - to.y) < 1e-14) continue;
    double angle = std::atan2(from.x * to.y - from.y * to.x, from.x * to.x + from.y * to.y);
    if (angle < 0) angle += 2 * kPi;
    border.push_back({from, to, true, angle});
  }
  return border;
}

}  // namespace luxfield::environment
