#include "luxfield/photometry/luminous_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/photometry/luminance.h"

namespace luxfield::photometry {
namespace {

using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::PosedLightField;
using lightfield::Vec3;

// Of the filter plane that is brightest along w.
double DistanceAlong(const Lamp& lamp, Vec3 eye, Vec3 w) {
  double distance = 0, most = -1e300;
  for (const PosedLightField& posed : lamp.fields) {
    const Vec3 p = posed.luminaire_from_field.Inverse().Point(eye),
               d = posed.luminaire_from_field.InverseDirection(w);
    if (!(p.z > 0 && d.z < 0)) continue;
    const Vec3 u = p + (-p.z / d.z) * d, s = p + ((posed.field.geometry.delta_m - p.z) / d.z) * d;
    const double there =
        lamp.fields.size() > 1 ? lightfield::Radiance(posed.field, {u.x, u.y}, {s.x, s.y})[0] : 0;
    if (there > most) most = there, distance = -p.z / d.z;
  }
  return distance;
}

// A picture's fields as bright or not.
class BrightFields {
 public:
  BrightFields(const LuminancePicture& picture, double threshold)
      : picture_(picture), threshold_(threshold) {}

  bool IsBright(double luminance) const { return luminance >= threshold_ && luminance > 0; }
  double At(int column, int row) const {
    return picture_.luminance[static_cast<std::size_t>(row) * picture_.columns + column];
  }
  // Is one of the eight fields around it bright where it is not, or the other way round?
  bool IsOnBorder(int column, int row) const {
    const bool own = IsBright(At(column, row));
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, picture_.rows - 1); ++y)
      for (int x = std::max(column - 1, 0); x <= std::min(column + 1, picture_.columns - 1); ++x)
        if (IsBright(At(x, y)) != own) return true;
    return false;
  }

 private:
  const LuminancePicture& picture_;
  double threshold_;
};

// Of a field of the picture, (k + 1/2) / count along one side and a radical inverse along the other, both
// moved by the field's own share: no edge of the lamp falls into step with them.
void LookCloser(const Lamp& lamp, Vec3 eye, const LuminancePicture& picture,
                const BrightFields& bright, int column, int row, int count,
                std::vector<BrightRay>* rays) {
  constexpr double kGolden = 0.6180339887498949, kSilver = 0.4142135623730951;
  const double field = row * picture.columns + column;
  const double solid_angle = picture.SolidAngle(column, row) / count;
  for (int k = 0; k < count; ++k) {
    double inverse = 0, digit = 0.5;
    for (int rest = k; rest > 0; rest /= 2, digit /= 2) inverse += digit * (rest % 2);
    const double x = (k + 0.5) / count + kGolden * field, y = inverse + kSilver * field;
    const Vec3 w = picture.Direction(column + x - std::floor(x), row + y - std::floor(y));
    const double luminance = LuminanceValue(lamp, eye, w);
    if (bright.IsBright(luminance))
      rays->push_back({w, luminance, DistanceAlong(lamp, eye, w), solid_angle, 0});
  }
}

// Where the border passes between two neighbouring fields: along x between columns, else along y between
// rows. It moves by dL / |grad L|; of its length the share that runs across is
//
//   dy |L_x| / |grad L|        (dx |L_y| / |grad L| between rows)
//
// with x and y on the plane of the picture. Both sums together are the integral along the border.
void AddCrossing(const Lamp& lamp, Vec3 eye, const LuminancePicture& picture,
                 const BrightFields& bright, double threshold, int column, int row, bool along_x,
                 std::vector<BrightRay>* rays) {
  const int next_column = column + along_x, next_row = row + !along_x;
  if (next_column >= picture.columns || next_row >= picture.rows) return;
  const double here = bright.At(column, row), there = bright.At(next_column, next_row);
  if (bright.IsBright(here) == bright.IsBright(there)) return;
  const double dx = (picture.x1 - picture.x0) / picture.columns,
               dy = (picture.y1 - picture.y0) / picture.rows;
  // The slope along the border's other axis, by the fields beside both.
  const auto across = [&](int x, int y) {
    const int x0 = along_x ? x : std::max(x - 1, 0), y0 = along_x ? std::max(y - 1, 0) : y;
    const int x1 = along_x ? x : std::min(x + 1, picture.columns - 1),
              y1 = along_x ? std::min(y + 1, picture.rows - 1) : y;
    const int steps = along_x ? y1 - y0 : x1 - x0;
    return steps > 0 ? (bright.At(x1, y1) - bright.At(x0, y0)) / steps : 0.0;
  };
  const double slope = (there - here) / (along_x ? dx : dy),
               other = 0.5 * (across(column, row) + across(next_column, next_row)) /
                       (along_x ? dy : dx);
  const double share = std::clamp((threshold - here) / (there - here), 0.0, 1.0);
  const double x = column + 0.5 + (along_x ? share : 0), y = row + 0.5 + (along_x ? 0 : share);
  const double per_plane =
      picture.SolidAngle(share < 0.5 ? column : next_column, share < 0.5 ? row : next_row) /
      (dx * dy);
  const Vec3 w = picture.Direction(x, y);
  rays->push_back(
      {w, threshold, DistanceAlong(lamp, eye, w), 0,
       per_plane * (along_x ? dy : dx) * std::abs(slope) / (slope * slope + other * other)});
}

// Integrals over the bright directions, and what a function of them changes by when they do.
struct Integrals {
  double solid_angle = 0, projected = 0, light = 0;
  Vec3 towards;  // of L w
};
Integrals IntegralsOf(const std::vector<BrightRay>& rays) {
  Integrals sum;
  for (const BrightRay& ray : rays) {
    const double light = ray.solid_angle * ray.luminance;
    sum.solid_angle += ray.solid_angle;
    sum.projected += ray.solid_angle * ray.distance_m * ray.distance_m;
    sum.light += light;
    sum.towards = sum.towards + light * ray.w;
  }
  return sum;
}

// Where the border is lost in noise, no linearisation tells how far it moves.
bool NoiseHidesBorder(const Lamp& lamp, Vec3 eye, const std::vector<BrightRay>& rays) {
  constexpr std::size_t kLooked = 16;
  std::vector<const BrightRay*> border;
  for (const BrightRay& ray : rays)
    if (ray.moves > 0) border.push_back(&ray);
  if (border.empty()) return false;
  double variance = 0;
  for (std::size_t k = 0; k < kLooked; ++k) {
    const BrightRay& ray = *border[k * border.size() / kLooked];
    const double u = Uncertainty(lamp, LuminanceTowards(lamp, eye, ray.w)).value_or(0);
    variance += u * u / kLooked;
  }
  return std::sqrt(variance) > 0.5 * border[0]->luminance;
}

std::optional<double> UncertaintyOf(const Lamp& lamp, Vec3 eye, const std::vector<BrightRay>& rays,
                                    const Integrals& slopes) {
  std::vector<WeighedRay> weighed;
  for (const BrightRay& ray : rays) {
    const double per_light = slopes.light + Dot(slopes.towards, ray.w);
    const double factor =
        ray.solid_angle * per_light +
        ray.moves * (slopes.solid_angle + slopes.projected * ray.distance_m * ray.distance_m +
                     ray.luminance * per_light);
    if (factor != 0) weighed.push_back({factor, ray.w});
  }
  return Uncertainty(lamp, LuminanceSum(lamp, eye, weighed));
}

// d ln p of the position index by the direction, across it.
Vec3 SlopeOfPosition(Vec3 line_of_sight, Vec3 up, Vec3 w) {
  constexpr double kStep = 1e-5;
  const Vec3 first = Normalized(std::abs(w.x) < 0.9 ? Vec3{1, 0, 0} - w.x * w
                                                    : Vec3{0, 1, 0} - w.y * w),
             second = Cross(w, first);
  Vec3 slope;
  for (const Vec3& side : {first, second}) {
    const auto at = [&](double step) {
      return std::log(PositionIndex(line_of_sight, up, Normalized(w + step * side)));
    };
    slope = slope + (at(kStep) - at(-kStep)) / (2 * kStep) * side;
  }
  return slope;
}

}  // namespace

std::vector<BrightRay> BrightRays(const Lamp& lamp, Vec3 eye, double threshold) {
  constexpr int kMost = 400, kCloser = 16, kAllCloser = 400000;
  const LuminancePicture picture = PictureFrom(lamp, eye, {0, 1, 0}, kMost);
  const BrightFields bright(picture, threshold);
  std::vector<BrightRay> rays;
  std::vector<std::array<int, 2>> border;
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.columns; ++column) {
      const double luminance = bright.At(column, row);
      if (bright.IsOnBorder(column, row)) {
        border.push_back({column, row});
      } else if (bright.IsBright(luminance)) {
        const Vec3 w = picture.Direction(column + 0.5, row + 0.5);
        rays.push_back(
            {w, luminance, DistanceAlong(lamp, eye, w), picture.SolidAngle(column, row), 0});
      }
    }
  const int closer =
      std::clamp(kAllCloser / std::max(1, static_cast<int>(border.size())), 1, kCloser);
  for (const auto& [column, row] : border) {
    LookCloser(lamp, eye, picture, bright, column, row, closer, &rays);
    if (lamp.noise.empty()) continue;
    for (const bool along_x : {true, false})
      AddCrossing(lamp, eye, picture, bright, threshold, column, row, along_x, &rays);
  }
  return rays;
}

std::optional<LuminousArea> AreaOf(const Lamp& lamp, Vec3 eye, const std::vector<BrightRay>& rays) {
  const Integrals sum = IntegralsOf(rays);
  if (!(sum.solid_angle > 0)) return {};
  LuminousArea area;
  area.solid_angle.value = sum.solid_angle;
  area.projected_m2.value = sum.projected;
  area.luminance.value = sum.light / sum.solid_angle;
  area.direction = Normalized(sum.towards);
  if (lamp.noise.empty() || NoiseHidesBorder(lamp, eye, rays)) return area;
  area.solid_angle.u = UncertaintyOf(lamp, eye, rays, {1, 0, 0, {}});
  area.projected_m2.u = UncertaintyOf(lamp, eye, rays, {0, 1, 0, {}});
  area.luminance.u = UncertaintyOf(
      lamp, eye, rays, {-area.luminance.value / sum.solid_angle, 0, 1 / sum.solid_angle, {}});
  return area;
}

std::optional<Estimate> GlareRatingOf(const Lamp& lamp, Vec3 eye,
                                      const std::vector<BrightRay>& rays, Vec3 line_of_sight,
                                      Vec3 up, double background) {
  const Integrals sum = IntegralsOf(rays);
  if (!(sum.solid_angle > 0) || !(Dot(sum.towards, line_of_sight) > 0)) return {};
  const Vec3 direction = Normalized(sum.towards);
  Estimate rating{UnifiedGlareRating(sum.light / sum.solid_angle, sum.solid_angle,
                                     PositionIndex(line_of_sight, up, direction), background),
                  {}};
  if (lamp.noise.empty() || NoiseHidesBorder(lamp, eye, rays)) return rating;
  // UGR = 8 log10(light^2 / omega) - 16 log10 p + const.
  const double unit = 8 / std::numbers::ln10;
  rating.u = UncertaintyOf(
      lamp, eye, rays,
      {-unit / sum.solid_angle, 0, 2 * unit / sum.light,
       -2 * unit / Length(sum.towards) * SlopeOfPosition(line_of_sight, up, direction)});
  return rating;
}

}  // namespace luxfield::photometry
