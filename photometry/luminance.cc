#include "luxfield/photometry/luminance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"

namespace luxfield::photometry {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::PosedLightField;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr double kSteepest = 6;  // the largest x and y of a picture, 81 degrees

// Where a line of sight crosses the planes of a field; nothing where it does not come from them.
struct Ray {
  Vec2 u, s;
};
std::optional<Ray> RayOf(const PosedLightField& posed, Vec3 eye, Vec3 w) {
  const Vec3 p = posed.luminaire_from_field.Inverse().Point(eye),
             d = posed.luminaire_from_field.InverseDirection(w);
  if (!(p.z > 0 && d.z < 0)) return {};
  const double to_f = -p.z / d.z, to_i = (posed.field.geometry.delta_m - p.z) / d.z;
  return Ray{{p.x + to_f * d.x, p.y + to_f * d.y}, {p.x + to_i * d.x, p.y + to_i * d.y}};
}

std::array<Vec3, 2> Across(Vec3 d, Vec3 up) {
  Vec3 across = up - Dot(up, d) * d;
  if (!(Length(across) > 1e-6)) across = Vec3{0, 1, 0} - d.y * d;
  if (!(Length(across) > 1e-6)) across = Vec3{1, 0, 0} - d.x * d;
  const Vec3 y = Normalized(across);
  return {Cross(d, y), y};
}

// of(w) for rays of equal solid angle over the cone.
template <typename F>
void ForCone(Vec3 w, double full_angle, F&& of) {
  constexpr int kRings = 16, kAround = 48;
  const auto [x, y] = Across(w, {0, 1, 0});
  for (int ring = 0; ring < kRings; ++ring) {
    // 1 - cos by its half angle, which keeps its digits.
    const double s = std::sin(full_angle / 4), versine = 2 * s * s * (ring + 0.5) / kRings;
    const double cosine = 1 - versine, sine = std::sqrt(versine * (2 - versine));
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / kAround;
      of(cosine * w + sine * std::cos(angle) * x + sine * std::sin(angle) * y,
         1.0 / (kRings * kAround));
    }
  }
}

// Rays of a cone that is much wider than the spacing of the basis might miss what is in it.
bool IsWide(const Lamp& lamp, Vec3 eye, double full_angle) {
  constexpr double kSpacings = 8;
  return std::any_of(lamp.fields.begin(), lamp.fields.end(), [&](const PosedLightField& posed) {
    const double z = posed.luminaire_from_field.Inverse().Point(eye).z;
    return z * full_angle > kSpacings * posed.field.geometry.grid.spacing_m;
  });
}

double SolidAngleOfCone(double full_angle) {
  const double s = std::sin(full_angle / 4);
  return 4 * std::numbers::pi * s * s;
}

// A ray that a field is seen along: its texel, and what there is times the basis at u.
struct Crossing {
  int row = 0, column = 0;
  Vec2 u;
  double factor = 0;
};

std::vector<Crossing> CrossingsOf(const PosedLightField& posed, Vec3 eye,
                                  const std::vector<WeighedRay>& rays) {
  const auto& g = posed.field.geometry;
  std::vector<Crossing> crossings;
  for (const auto& [factor, w] : rays) {
    const auto ray = RayOf(posed, eye, w);
    if (!ray) continue;
    const double column = std::floor(g.lattice.column_of_s(ray->s.x)),
                 row = std::floor(g.lattice.row_of_t(ray->s.y));
    if (!(column >= 0 && column < g.lattice.width && row >= 0 && row < g.lattice.height)) continue;
    const double cosine = lightfield::CosTheta(g.delta_m, ray->u, ray->s),
                 d = g.delta_m / (cosine * cosine);
    crossings.push_back({static_cast<int>(row), static_cast<int>(column), ray->u, factor * d * d});
  }
  return crossings;
}

TexelWindow WindowOf(const std::vector<Crossing>& crossings) {
  int row0 = crossings[0].row, row1 = row0, column0 = crossings[0].column, column1 = column0;
  for (const Crossing& one : crossings) {
    row0 = std::min(row0, one.row);
    row1 = std::max(row1, one.row);
    column0 = std::min(column0, one.column);
    column1 = std::max(column1, one.column);
  }
  return {row0, row1 - row0 + 1, column0, column1 - column0 + 1};
}

// Corners of the supports on F that the eye is before.
std::vector<Vec3> CornersSeen(const Lamp& lamp, Vec3 eye) {
  std::vector<Vec3> corners;
  for (const PosedLightField& posed : lamp.fields) {
    if (!(posed.luminaire_from_field.Inverse().Point(eye).z > 0)) continue;
    const auto& grid = posed.field.geometry.grid;
    const double u1 = grid.u0_m + (grid.width + grid.basis.cells - 1) * grid.spacing_m,
                 v1 = grid.v0_m + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
    for (const double u : {grid.u0_m, u1})
      for (const double v : {grid.v0_m, v1})
        corners.push_back(posed.luminaire_from_field.Point({u, v, 0}));
  }
  return corners;
}

void Fill(const Lamp& lamp, Vec3 eye, LuminancePicture* picture) {
  picture->luminance.resize(static_cast<std::size_t>(picture->columns) * picture->rows);
  core::ParallelFor(picture->rows, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < picture->columns; ++column)
        picture->luminance[row * picture->columns + column] = LuminanceValue(
            lamp, eye, picture->Direction(column + 0.5, static_cast<double>(row) + 0.5));
  });
}

// What a picture's fields hold of the light at the eye, and where.
class Light {
 public:
  explicit Light(const LuminancePicture& picture) {
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.columns; ++column) {
        const std::size_t k = static_cast<std::size_t>(row) * picture.columns + column;
        parts_.push_back({picture.Direction(column + 0.5, row + 0.5),
                          picture.luminance[k] * picture.SolidAngle(column, row)});
      }
  }
  // Over a cone about w, by the fields whose middles it holds.
  double Within(Vec3 w, double full_angle) const {
    const double least_cosine = std::cos(full_angle / 2);
    double sum = 0;
    for (const auto& [d, light] : parts_) sum += Dot(d, w) >= least_cosine ? light : 0.0;
    return sum;
  }

 private:
  struct Part {
    Vec3 d;
    double light = 0;
  };
  std::vector<Part> parts_;
};

// Sums over discs of `radius` fields about every field.
std::vector<double> DiscMeans(const LuminancePicture& picture, double radius) {
  std::vector<std::array<int, 2>> disc;
  const int reach = static_cast<int>(radius);
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x)
      if (x * x + y * y <= radius * radius) disc.push_back({x, y});
  std::vector<double> means(picture.luminance.size(), 0.0);
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.columns; ++column) {
      double sum = 0;
      for (const auto& [x, y] : disc)
        if (row + y >= 0 && row + y < picture.rows && column + x >= 0 &&
            column + x < picture.columns)
          sum +=
              picture.luminance[static_cast<std::size_t>(row + y) * picture.columns + column + x];
      means[static_cast<std::size_t>(row) * picture.columns + column] =
          sum / static_cast<double>(disc.size());
    }
  return means;
}

// From w by steps on a plane across it, halved down to `least`, to where value(direction) is largest.
template <typename F>
Vec3 Climb(F&& value, Vec3 w, double step, double least) {
  const std::array<Vec3, 2> sides = Across(w, {0, 1, 0});
  const auto at = [&](Vec2 aside) {
    return Normalized(w + aside.x * sides[0] + aside.y * sides[1]);
  };
  Vec2 here{0, 0};
  double best = value(w);
  while (step > least) {
    core::ThrowIfInterrupted();
    Vec2 found = here;
    double most = best;
    for (const Vec2 way : {Vec2{-step, 0}, Vec2{step, 0}, Vec2{0, -step}, Vec2{0, step}}) {
      const Vec2 place{here.x + way.x, here.y + way.y};
      if (const double there = value(at(place)); there > most) most = there, found = place;
    }
    if (most > best)
      best = most, here = found;
    else
      step /= 2;
  }
  return at(here);
}

// Where corners lie on a plane across `ahead` at distance 1, not beyond kSteepest.
struct Extent {
  double x0 = kSteepest, x1 = -kSteepest, y0 = kSteepest, y1 = -kSteepest;
};
Extent ExtentOf(const std::vector<Vec3>& corners, Vec3 eye, Vec3 ahead, Vec3 right, Vec3 up) {
  Extent extent;
  for (const Vec3& corner : corners) {
    const Vec3 d = corner - eye;
    const double depth = std::max(Dot(d, ahead), 1e-9);
    const double x = std::clamp(Dot(d, right) / depth, -kSteepest, kSteepest),
                 y = std::clamp(Dot(d, up) / depth, -kSteepest, kSteepest);
    extent.x0 = std::min(extent.x0, x);
    extent.x1 = std::max(extent.x1, x);
    extent.y0 = std::min(extent.y0, y);
    extent.y1 = std::max(extent.y1, y);
  }
  return extent;
}

// The tangent of half a texel and half a spacing of the basis as they are seen along w; 0 where w does
// not come from a filter plane.
double FinestSeen(const Lamp& lamp, Vec3 eye, Vec3 w) {
  double finest = 0;
  for (const PosedLightField& posed : lamp.fields) {
    const auto& g = posed.field.geometry;
    const double z = posed.luminaire_from_field.Inverse().Point(eye).z,
                 cosine = -posed.luminaire_from_field.InverseDirection(w).z;
    if (!(z > 0 && cosine > 0)) continue;
    // A border s of a texel moves by |1 - delta / z| of where it is seen on F.
    const double texel =
        std::min(g.lattice.ds_m, g.lattice.dt_m) / std::max(std::abs(1 - g.delta_m / z), 1e-9);
    const double step = 0.5 * std::min(texel, g.grid.spacing_m) * cosine * cosine / z;
    finest = finest > 0 ? std::min(finest, step) : step;
  }
  return finest;
}

}  // namespace

Functional LuminanceSum(const Lamp& lamp, Vec3 eye, const std::vector<WeighedRay>& rays) {
  Functional sum(lamp.fields.size());
  for (std::size_t k = 0; k < sum.size(); ++k) {
    const auto crossings = CrossingsOf(lamp.fields[k], eye, rays);
    if (crossings.empty()) continue;
    const auto& grid = lamp.fields[k].field.geometry.grid;
    auto& [window, weights] = sum[k];
    window = WindowOf(crossings);
    weights.assign(grid.count() * window.size(), 0.0);
    for (const Crossing& one : crossings) {
      const double x = (one.u.x - grid.u0_m) / grid.spacing_m,
                   y = (one.u.y - grid.v0_m) / grid.spacing_m;
      const int last_i = static_cast<int>(std::floor(x)), last_j = static_cast<int>(std::floor(y));
      const std::size_t texel =
          std::size_t(one.row - window.row0) * window.columns + one.column - window.column0;
      for (int j = std::max(0, last_j - grid.basis.cells + 1);
           j <= std::min(last_j, grid.height - 1); ++j)
        for (int i = std::max(0, last_i - grid.basis.cells + 1);
             i <= std::min(last_i, grid.width - 1); ++i)
          weights[grid.index(i, j) * window.size() + texel] +=
              one.factor * grid.basis.Value(x - i) * grid.basis.Value(y - j);
    }
  }
  return sum;
}

Functional LuminanceTowards(const Lamp& lamp, Vec3 eye, Vec3 w) {
  return LuminanceSum(lamp, eye, {{1, w}});
}

double LuminanceValue(const Lamp& lamp, Vec3 eye, Vec3 w) {
  double sum = 0;
  for (const PosedLightField& posed : lamp.fields)
    if (const auto ray = RayOf(posed, eye, w))
      sum += lightfield::Radiance(posed.field, ray->u, ray->s)[0];
  return sum;
}

Functional MeanLuminance(const Lamp& lamp, Vec3 eye, Vec3 w, double full_angle) {
  if (IsWide(lamp, eye, full_angle)) {
    const Functional light = LightWithin(lamp, eye, w, full_angle / 2);
    return Sum({{1 / SolidAngleOfCone(full_angle), &light}});
  }
  std::vector<WeighedRay> rays;
  ForCone(w, full_angle, [&](Vec3 ray, double share) { rays.push_back({share, ray}); });
  return LuminanceSum(lamp, eye, rays);
}

double MeanLuminanceValue(const Lamp& lamp, Vec3 eye, Vec3 w, double full_angle) {
  if (IsWide(lamp, eye, full_angle)) return Value(lamp, MeanLuminance(lamp, eye, w, full_angle));
  double mean = 0;
  ForCone(w, full_angle,
          [&](Vec3 ray, double share) { mean += share * LuminanceValue(lamp, eye, ray); });
  return mean;
}

Vec3 LuminancePicture::Direction(double column, double row) const {
  const double x = x0 + (x1 - x0) * column / columns, y = y1 - (y1 - y0) * row / rows;
  return Normalized(centre + x * right + y * up);
}

double LuminancePicture::SolidAngle(int column, int row) const {
  const double x = x0 + (x1 - x0) * (column + 0.5) / columns,
               y = y1 - (y1 - y0) * (row + 0.5) / rows;
  return (x1 - x0) / columns * (y1 - y0) / rows / std::pow(1 + x * x + y * y, 1.5);
}

std::optional<Vec3> MiddleSeen(const Lamp& lamp, Vec3 eye) {
  const auto corners = CornersSeen(lamp, eye);
  if (corners.empty()) return {};
  Vec3 middle;
  for (const Vec3& corner : corners) middle = middle + (1.0 / double(corners.size())) * corner;
  return middle;
}

LuminancePicture PictureFrom(const Lamp& lamp, Vec3 eye, Vec3 up, int most) {
  LuminancePicture picture;
  const auto middle = MiddleSeen(lamp, eye);
  if (!middle) return picture;
  picture.centre = Normalized(*middle - eye);
  const auto [right, upwards] = Across(picture.centre, up);
  picture.right = right;
  picture.up = upwards;
  const Extent extent = ExtentOf(CornersSeen(lamp, eye), eye, picture.centre, right, upwards);
  picture.x0 = extent.x0;
  picture.x1 = extent.x1;
  picture.y0 = extent.y0;
  picture.y1 = extent.y1;
  const double wide = picture.x1 - picture.x0, high = picture.y1 - picture.y0,
               field = std::max(wide, high) / most;
  picture.columns = std::clamp(static_cast<int>(std::lround(wide / field)), 1, most);
  picture.rows = std::clamp(static_cast<int>(std::lround(high / field)), 1, most);
  Fill(lamp, eye, &picture);
  return picture;
}

Vec3 BrightestPlace(const Lamp& lamp, Vec3 eye, double full_angle) {
  constexpr int kMost = 300, kLeast = 24;
  constexpr std::size_t kStarts = 4;
  LuminancePicture picture = PictureFrom(lamp, eye, {0, 1, 0}, 1);
  if (picture.columns == 0) return Normalized(-1 * eye);
  const auto corners = CornersSeen(lamp, eye);
  const double least_cosine = std::cos(full_angle / 2);
  if (std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
        return Dot(Normalized(corner - eye), picture.centre) >= least_cosine;
      }))
    return picture.centre;
  const double extent = std::max(picture.x1 - picture.x0, picture.y1 - picture.y0);
  const int fields = std::clamp(static_cast<int>(6 * extent / full_angle), kLeast, kMost);
  picture = PictureFrom(lamp, eye, {0, 1, 0}, fields);
  const double field = extent / fields;
  const auto means = DiscMeans(picture, std::min(0.5 * full_angle / field, double(fields)));
  std::vector<std::size_t> order(means.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  const std::size_t starts = std::min(kStarts, order.size());
  std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(starts), order.end(),
                    [&](std::size_t a, std::size_t b) { return means[a] > means[b]; });
  // The exact mean over a wide field of view takes long, and a sum over a fine picture finds its place.
  constexpr int kFine = 240;
  std::optional<Light> light;
  if (IsWide(lamp, eye, full_angle)) light.emplace(PictureFrom(lamp, eye, {0, 1, 0}, kFine));
  Vec3 brightest = picture.centre;
  double most = -1e300;
  for (std::size_t k = 0; k < starts; ++k) {
    const std::size_t whole_rows = order[k] / picture.columns;
    const auto column = static_cast<double>(order[k] % picture.columns),
               row = static_cast<double>(whole_rows);
    const auto mean = [&](Vec3 d) {
      return light ? light->Within(d, full_angle) : MeanLuminanceValue(lamp, eye, d, full_angle);
    };
    const Vec3 w =
        Climb(mean, picture.Direction(column + 0.5, row + 0.5), field, 0.02 * full_angle);
    if (const double there = mean(w); there > most) most = there, brightest = w;
  }
  return brightest;
}

Vec3 BrightestRay(const Lamp& lamp, Vec3 eye, Vec3 w, double full_angle) {
  constexpr int kMost = 400, kLeast = 8;
  constexpr std::size_t kStarts = 6;
  const auto [right, up] = Across(w, {0, 1, 0});
  const double half = std::tan(full_angle / 2), least_cosine = std::cos(full_angle / 2);
  Extent extent = ExtentOf(CornersSeen(lamp, eye), eye, w, right, up);
  extent.x0 = std::max(extent.x0, -half);
  extent.x1 = std::min(extent.x1, half);
  extent.y0 = std::max(extent.y0, -half);
  extent.y1 = std::min(extent.y1, half);
  const double wide = extent.x1 - extent.x0, high = extent.y1 - extent.y0;
  if (!(wide > 0 && high > 0)) return w;
  const double seen = FinestSeen(lamp, eye, w);
  const auto parts = [&](double length) {
    return seen > 0 ? std::clamp(static_cast<int>(length / seen) + 1, kLeast, kMost) : kMost;
  };
  const int columns = parts(wide), rows = parts(high);
  const auto value = [&](Vec3 d) {
    return Dot(d, w) >= least_cosine ? LuminanceValue(lamp, eye, d) : -1e300;
  };
  std::vector<std::pair<double, Vec3>> rays{{value(w), w}};
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const Vec3 d = Normalized(w + (extent.x0 + wide * column / columns) * right +
                                (extent.y0 + high * row / rows) * up);
      rays.push_back({value(d), d});
    }
  const auto starts = std::ptrdiff_t(std::min(kStarts, rays.size()));
  std::partial_sort(rays.begin(), rays.begin() + starts, rays.end(),
                    [](const auto& a, const auto& b) { return a.first > b.first; });
  const double step = std::max(wide / columns, high / rows);
  for (auto ray = rays.begin(); ray != rays.begin() + starts; ++ray) {
    ray->second = Climb(value, ray->second, step, 1e-3 * step);
    ray->first = value(ray->second);
  }
  return std::max_element(rays.begin(), rays.begin() + starts,
                          [](const auto& a, const auto& b) { return a.first < b.first; })
      ->second;
}

double PositionIndex(Vec3 line_of_sight, Vec3 up, Vec3 w) {
  constexpr double kDegree = std::numbers::pi / 180;
  const auto [right, upwards] = Across(line_of_sight, up);
  const double ahead = Dot(w, line_of_sight), x = std::abs(Dot(w, right)), y = Dot(w, upwards);
  const double beta = std::atan2(std::hypot(x, y), ahead) / kDegree;
  const double alpha = std::atan2(x, y) / kDegree;
  return std::exp((35.2 - 0.31889 * alpha - 1.22 * std::exp(-2 * alpha / 9)) * 1e-3 * beta +
                  (21 + 0.26667 * alpha - 0.002963 * alpha * alpha) * 1e-5 * beta * beta);
}

double UnifiedGlareRating(double luminance, double solid_angle, double position_index,
                          double background) {
  return 8 * std::log10(0.25 / background * luminance * luminance * solid_angle /
                        (position_index * position_index));
}

double ThresholdIncrement(double veiling, double road) {
  constexpr double kBright = 5;
  return road <= kBright ? 65 * veiling / std::pow(road, 0.8) : 95 * veiling / std::pow(road, 1.05);
}

double SolidAngleOfOpening(Vec3 eye, double width_m, double height_m) {
  const auto corner = [&](double x, double y) {
    return Vec3{x * width_m / 2, y * height_m / 2, 0} - eye;
  };
  const auto triangle = [](Vec3 a, Vec3 b, Vec3 c) {
    const double la = Length(a), lb = Length(b), lc = Length(c);
    return 2 * std::atan2(std::abs(Dot(a, Cross(b, c))),
                          la * lb * lc + Dot(a, b) * lc + Dot(a, c) * lb + Dot(b, c) * la);
  };
  return triangle(corner(-1, -1), corner(1, -1), corner(1, 1)) +
         triangle(corner(-1, -1), corner(1, 1), corner(-1, 1));
}

}  // namespace luxfield::photometry
