#include "luxfield/cli/reports/eye_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "luxfield/cli/svg/svg_isolux.h"
#include "luxfield/photometry/luminance.h"

namespace luxfield::cli {
namespace {

using formats::Eye;
using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kPixels = 160;  // along the longer side
constexpr double kWidest_deg = 150;

// As near to `up` as can be across the view.
Vec3 Upwards(Vec3 way, Vec3 up) {
  for (const Vec3 one : {up, Vec3{0, 1, 0}, Vec3{1, 0, 0}})
    if (Length(Cross(way, one)) > 1e-3 * Length(way)) return one;
  return {0, 0, 1};
}

// As wide and high as the lamp is seen, not beyond 4 : 1.
void SetSize(const photometry::Lamp& lamp, Eye* eye) {
  const auto frame = photometry::PictureFrom(lamp, eye->position_m, eye->up, 1);
  const double ratio =
      std::clamp((frame.y1 - frame.y0) / std::max(frame.x1 - frame.x0, 1e-12), 0.25, 4.0);
  eye->width = static_cast<int>(std::lround(ratio > 1 ? kPixels / ratio : kPixels));
  eye->height = static_cast<int>(std::lround(ratio > 1 ? kPixels : kPixels * ratio));
}

// Where directions lie on the map.
class Projection {
 public:
  explicit Projection(const Eye& eye)
      : eye_(eye),
        forward_(formats::Forward(eye)),
        right_(Normalized(Cross(forward_, eye.up))),
        top_(Cross(right_, forward_)),
        distance_(Length(eye.look_at_m - eye.position_m)) {}

  bool IsFisheye() const { return eye_.projection == Eye::Projection::kFisheye; }
  // Half of the map, from its middle to its upper edge.
  double Half() const {
    return IsFisheye() ? eye_.fov_deg / 2 : distance_ * std::tan(kDegree * eye_.fov_deg / 2);
  }
  std::optional<std::array<double, 2>> Place(Vec3 d) const {
    const double x = Dot(d, right_), y = Dot(d, top_), ahead = Dot(d, forward_);
    if (IsFisheye()) {
      const double across = std::hypot(x, y), degrees = std::atan2(across, ahead) / kDegree;
      const double factor = across > 1e-12 ? degrees / across : 0;
      return std::array{factor * x, factor * y};
    }
    if (!(ahead > 1e-3)) return {};
    return std::array{distance_ * x / ahead, distance_ * y / ahead};
  }
  // The edge of a cone about w.
  IsoluxLine Ring(Vec3 w, double full_angle) const {
    constexpr int kSteps = 96;
    const Vec3 x = Normalized(Cross(w, std::abs(w.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const Vec3 y = Cross(w, x);
    IsoluxLine line;
    for (int k = 0; k <= kSteps; ++k) {
      const double angle = 2 * std::numbers::pi * k / kSteps;
      const Vec3 aside = std::cos(angle) * x + std::sin(angle) * y;
      const auto place = Place(std::cos(full_angle / 2) * w + std::sin(full_angle / 2) * aside);
      if (place) line.points.push_back(*place);
    }
    return line;
  }

 private:
  Eye eye_;
  Vec3 forward_, right_, top_;
  double distance_ = 0;
};

}  // namespace

std::optional<Eye> PictureAsked(const photometry::Lamp& lamp, const photometry::EyeAsked& asked) {
  const auto middle = photometry::MiddleSeen(lamp, asked.eye_m);
  if (asked.picture == photometry::EyePicture::kNone || !middle) return {};
  Eye eye;
  eye.position_m = asked.eye_m;
  eye.look_at_m = *middle;
  eye.up = Upwards(eye.look_at_m - eye.position_m, asked.up);
  eye.fov_deg = kWidest_deg;
  eye.width = eye.height = kPixels;
  if (asked.picture == photometry::EyePicture::kPerspective &&
      formats::ShowsWholeLamp(eye, lamp.fields)) {
    SetSize(lamp, &eye);
    eye.fov_deg = formats::FovOfWholeLamp(eye, lamp.fields);
    return eye;
  }
  eye.projection = Eye::Projection::kFisheye;
  eye.fov_deg = 180;
  if (asked.line_of_sight) {
    eye.look_at_m = eye.position_m + *asked.line_of_sight;
    eye.up = Upwards(*asked.line_of_sight, asked.up);
  }
  return eye;
}

std::string EyePictureNote(const photometry::EyeAnswer& answer, const PhotometryNames& names) {
  const bool lit = std::any_of(answer.fields.begin(), answer.fields.end(),
                               [](const auto& field) { return field.peak.value > 0; });
  return lit ? fmt::format(
                   "Rings and crosses are the fields of view in which the mean {} is largest.",
                   names.Luminance())
             : "";
}

std::string ExportNoteOf(const Eye& eye, const std::string& file) {
  const auto vector = [](Vec3 v) { return fmt::format("{:.6g} {:.6g} {:.6g}", v.x, v.y, v.z); };
  return fmt::format(
      "As a file of luminances: luxfield export {} -o X.hdr --view {} --eye {} --look-at {} --up "
      "{} "
      "--fov {:.6g} --size {} {}",
      std::filesystem::path(file).filename().string(),
      eye.projection == Eye::Projection::kFisheye ? "fisheye" : "perspective",
      vector(eye.position_m), vector(eye.look_at_m), vector(eye.up), eye.fov_deg, eye.width,
      eye.height);
}

std::string SvgEyePicture(const photometry::Lamp& lamp, const photometry::EyeAnswer& answer,
                          const Eye& eye, const PhotometryNames& names) {
  constexpr int kSamples = 2;
  constexpr std::uint64_t kSeed = 1;
  const Projection projection(eye);
  const core::Image image = formats::DrawLamp(lamp.fields, eye, kSamples, kSeed).image;
  IsoluxMap map;
  map.title = fmt::format("{}, {}", names.LuminanceTitle(), answer.asked.name);
  map.unit = names.LuminanceUnit();
  map.x_label = projection.IsFisheye() ? "to the right, °" : "to the right, m at the lamp";
  map.y_label = projection.IsFisheye() ? "upwards, °" : "upwards, m at the lamp";
  map.y1 = projection.Half();
  map.x1 = map.y1 * eye.width / eye.height;
  map.x0 = -map.x1;
  map.y0 = -map.y1;
  map.columns = eye.width;
  map.rows = eye.height;
  map.values.assign(image.data.begin(), image.data.end());
  map.outlined = false;
  for (const auto& field : answer.fields) {
    if (!(field.peak.value > 0)) continue;
    map.lines.push_back(projection.Ring(field.direction, 1e-3 * field.mrad));
    if (const auto place = projection.Place(field.direction))
      map.marks.push_back({(*place)[0], (*place)[1], fmt::format("{:g} mrad", field.mrad), true});
  }
  return SvgIsolux(map);
}

}  // namespace luxfield::cli
