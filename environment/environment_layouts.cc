#include "luxfield/environment/environment_layouts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/environment/cube_map.h"
#include "luxfield/environment/disc_layout.h"

namespace luxfield::environment {
namespace {

constexpr double kPi = std::numbers::pi;

struct Named {
  EnvironmentLayout layout;
  const char* name;
};
constexpr Named kNames[] = {{EnvironmentLayout::kLatitudeLongitude, "latitude-longitude"},
                            {EnvironmentLayout::kAngularMap, "angular-map"},
                            {EnvironmentLayout::kMirrorBall, "mirror-ball"},
                            {EnvironmentLayout::kFisheyeHemisphere, "fisheye-hemisphere"},
                            {EnvironmentLayout::kCube, "cube"}};

// OpenEXR's faces from top to bottom as ours: +X, -X, +Y, -Y, +Z, -Z in its frame.
constexpr std::array<int, 6> kStripFaces = {0, 1, 4, 5, 3, 2};

PictureToDirection LatitudeLongitude(lightfield::Vec2 p) {
  const double theta = kPi * p.y, phi = kPi * (1 - 2 * p.x);
  const double sine = std::sin(theta);
  return {{sine * std::sin(phi), -sine * std::cos(phi), std::cos(theta)}, 2 * kPi * kPi * sine};
}

// Where a picture point lies on face number `strip` of the strip.
CubePoint StripPoint(int strip, lightfield::Vec2 p) {
  return {kStripFaces[strip], 2 * p.x - 1, 1 - 2 * (6 * p.y - strip)};
}

int StripOf(double y) { return std::clamp(static_cast<int>(6 * y), 0, 5); }

// The directions of one rectangle's picture points. A cube's rectangle lies on one face, its border
// included.
class Chart {
 public:
  Chart(EnvironmentLayout layout, double y0, double y1)
      : layout_(layout), disc_(FindDisc(layout)), strip_(StripOf(0.5 * (y0 + y1))) {}

  PictureToDirection At(lightfield::Vec2 p) const {
    if (disc_) return disc_->At({2 * p.x - 1, 1 - 2 * p.y});
    if (layout_ == EnvironmentLayout::kLatitudeLongitude) return LatitudeLongitude(p);
    const CubePoint q = StripPoint(strip_, p);
    return {lightfield::Normalized(CubeVector(q)), 24 * CubeSolidAnglePerArea(q.x, q.y)};
  }

 private:
  EnvironmentLayout layout_;
  const Disc* disc_;
  int strip_;
};

// Appends the curve over the picture's line from p0 to p1, its end left out.
class Tracer {
 public:
  Tracer(const Chart& chart, double area, double tolerance, std::vector<lightfield::Vec3>& outline)
      : chart_(chart), area_(tolerance * area), outline_(outline) {}

  void Line(lightfield::Vec2 p0, lightfield::Vec2 p1) {
    Line(p0, chart_.At(p0).direction, p1, chart_.At(p1).direction, 12);
  }

 private:
  void Line(lightfield::Vec2 p0, lightfield::Vec3 d0, lightfield::Vec2 p1, lightfield::Vec3 d1,
            int depth) {
    const lightfield::Vec2 middle = 0.5 * (p0 + p1);
    const auto [direction, density] = chart_.At(middle);
    // The curve and its chord enclose two thirds of chord times sagitta, which is the triple
    // product.
    const double enclosed =
        2.0 / 3 * std::abs(lightfield::Dot(direction, lightfield::Cross(d0, d1 - d0)));
    if (depth == 0 || enclosed <= area_ * density) {
      outline_.push_back(d0);
      return;
    }
    Line(p0, d0, middle, direction, depth - 1);
    Line(middle, direction, p1, d1, depth - 1);
  }

  const Chart& chart_;
  double area_;
  std::vector<lightfield::Vec3>& outline_;
};

}  // namespace

std::string_view EnvironmentLayoutName(EnvironmentLayout layout) {
  return kNames[static_cast<int>(layout)].name;
}

std::optional<EnvironmentLayout> EnvironmentLayoutFromName(std::string_view name) {
  for (const Named& named : kNames)
    if (name == named.name) return named.layout;
  return {};
}

std::string EnvironmentLayoutNames() {
  std::string names;
  for (const Named& named : kNames) names += (names.empty() ? "" : ", ") + std::string(named.name);
  return names;
}

std::optional<PictureToDirection> DirectionFromPicture(EnvironmentLayout layout,
                                                       lightfield::Vec2 p) {
  if (!(p.x >= 0 && p.x <= 1 && p.y >= 0 && p.y <= 1)) return {};
  const lightfield::Vec2 q = {2 * p.x - 1, 1 - 2 * p.y};
  if (FindDisc(layout) && q.x * q.x + q.y * q.y > 1) return {};
  return Chart(layout, p.y, p.y).At(p);
}

std::optional<DirectionToPicture> PictureFromDirection(EnvironmentLayout layout,
                                                       lightfield::Vec3 direction) {
  const lightfield::Vec3 w = lightfield::Normalized(direction);
  if (const Disc* disc = FindDisc(layout)) {
    const auto q = disc->Find(w);
    if (!q) return {};
    return DirectionToPicture{{0.5 * (1 + q->x), 0.5 * (1 - q->y)},
                              1 / disc->At(*q).solid_angle_per_area};
  }
  if (layout == EnvironmentLayout::kLatitudeLongitude) {
    const double sine = std::hypot(w.x, w.y);
    const double phi = std::atan2(w.x, -w.y);
    return DirectionToPicture{{0.5 * (1 - phi / kPi), std::atan2(sine, w.z) / kPi},
                              1 / (2 * kPi * kPi * sine)};
  }
  const CubePoint q = CubePointFromDirection(w);
  const auto strip =
      std::find(kStripFaces.begin(), kStripFaces.end(), q.face) - kStripFaces.begin();
  return DirectionToPicture{{0.5 * (1 + q.x), (double(strip) + 0.5 * (1 - q.y)) / 6},
                            1 / (24 * CubeSolidAnglePerArea(q.x, q.y))};
}

TexelEdges MakeTexelEdges(EnvironmentLayout layout, TexelRegistration registration, int width,
                          int height) {
  const auto axis = [registration](int count, int pieces) {
    std::vector<double> edges;
    const int texels = count / pieces;
    for (int piece = 0; piece < pieces; ++piece)
      for (int k = 0; k < texels; ++k) {
        double edge = double(k) / texels;
        if (registration == TexelRegistration::kNodes && k > 0) edge = (k - 0.5) / (texels - 1);
        edges.push_back((piece + edge) / pieces);
      }
    edges.push_back(1);
    return edges;
  };
  return {axis(width, 1), axis(height, layout == EnvironmentLayout::kCube ? 6 : 1)};
}

double PictureRectangleSolidAngle(EnvironmentLayout layout, double x0, double x1, double y0,
                                  double y1) {
  if (const Disc* disc = FindDisc(layout))
    return disc->SolidAngle({2 * x0 - 1, 1 - 2 * y1}, {2 * x1 - 1, 1 - 2 * y0});
  if (layout == EnvironmentLayout::kLatitudeLongitude)
    // cos(theta0) - cos(theta1) without the cancellation
    return 2 * kPi * (x1 - x0) * 2 * std::sin(0.5 * kPi * (y0 + y1)) *
           std::sin(0.5 * kPi * (y1 - y0));
  const int strip = StripOf(0.5 * (y0 + y1));
  const CubePoint top = StripPoint(strip, {x0, y0}), bottom = StripPoint(strip, {x1, y1});
  return CubeRectangleSolidAngle(top.x, bottom.x, bottom.y, top.y);
}

void PictureRectangleOutline(EnvironmentLayout layout, double x0, double x1, double y0, double y1,
                             double tolerance, std::vector<lightfield::Vec3>& outline) {
  outline.clear();
  const Chart chart(layout, y0, y1);
  Tracer tracer(chart, (x1 - x0) * (y1 - y0), tolerance, outline);
  const auto* disc = FindDisc(layout);
  if (!disc) {
    const lightfield::Vec2 corners[] = {{x0, y0}, {x0, y1}, {x1, y1}, {x1, y0}};
    for (int k = 0; k < 4; ++k) tracer.Line(corners[k], corners[(k + 1) % 4]);
    return;
  }
  const auto picture_point = [](lightfield::Vec2 q) {
    return lightfield::Vec2{0.5 * (1 + q.x), 0.5 * (1 - q.y)};
  };
  for (const DiscPiece& piece : ClipToDisc({2 * x0 - 1, 1 - 2 * y1}, {2 * x1 - 1, 1 - 2 * y0})) {
    if (!piece.is_arc) {
      tracer.Line(picture_point(piece.from), picture_point(piece.to));
      continue;
    }
    // A few chords of the rim: it shows one direction, or the horizon, which is a great circle.
    const int steps = 1 + static_cast<int>(piece.angle);
    const double start = std::atan2(piece.from.y, piece.from.x);
    for (int k = 0; k < steps; ++k) {
      const double angle = start + piece.angle * k / steps;
      outline.push_back(disc->At({std::cos(angle), std::sin(angle)}).direction);
    }
  }
}

}  // namespace luxfield::environment
