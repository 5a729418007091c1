// A lamp as an eye sees it, and the light it throws on a plane, as pictures. All in the luminaire's
// frame (docs/axes.md), metres.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "luxfield/core/image.h"
#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {

// Where a pixel's middle lies is column + 1/2, row + 1/2; row 0 is on top. With f the unit vector
// towards look_at, r = f x up and t = r x f, both of unit length, a point (x, y) of a picture of
// w x h pixels shows the direction
//
//   perspective:      f + (2 x - w) / h tan(fov/2) r + (1 - 2 y / h) tan(fov/2) t
//   fisheye:          at the angle |q| fov/2 from f towards q_x r + q_y t,
//                     q = (2 x - w, h - 2 y) / min(w, h), |q| <= 1; nothing beyond
//   equirectangular:  cos e cos a f + cos e sin a r + sin e t,
//                     a = 2 pi (x / w - 1/2), e = pi (1/2 - y / h)
struct Eye {
  enum class Projection { kPerspective, kFisheye, kEquirectangular };
  Projection projection = Projection::kPerspective;
  lightfield::Vec3 position_m, look_at_m, up{0, 1, 0};
  double fov_deg = 40;  // perspective: between the upper and the lower edge
  int width = 512, height = 512;

  // Throws InputError where look_at is the position or up is parallel to the view.
  void Validate() const;
};

// Direction of a point of the picture, unit, and the solid angle that a pixel there has.
struct EyeRay {
  lightfield::Vec3 direction;
  double solid_angle = 0;
};
std::optional<EyeRay> RayOf(const Eye& eye, double x, double y);

// Unit vector towards look_at.
lightfield::Vec3 Forward(const Eye& eye);

// The angle between upper and lower edge with which a perspective picture holds the supports on F of
// all fields and a tenth more. Throws InputError where the eye sees a corner of them at more than 80
// degrees from f.
double FovOfWholeLamp(const Eye& eye, std::span<const lightfield::PosedLightField> fields);
// Whether all corners of the supports on F lie in the picture.
bool ShowsWholeLamp(const Eye& eye, std::span<const lightfield::PosedLightField> fields);

// Radiance in (unit) sr^-1 m^-2, of lm in cd m^-2, along d from p; of three channels if all fields
// have three, else all fields' luminance in the first.
std::array<double, 3> RadianceTowards(std::span<const lightfield::PosedLightField> fields,
                                      lightfield::Vec3 p, lightfield::Vec3 d);

struct LampPicture {
  core::Image image;  // one channel, or three of Rec. 709
  // Standard deviation, at most, of the irradiance at the eye that the picture's luminance sums to.
  double irradiance_sigma = 0;
};

// Means over the pixels of radiance: samples x samples rays each, one drawn in each part of an even
// division, by `seed`.
LampPicture DrawLamp(std::span<const lightfield::PosedLightField> fields, const Eye& eye,
                     int samples, std::uint64_t seed);

// Irradiance (lm m^-2 or W m^-2) on a rectangle of width_m x height_m about the eye's position that
// faces look_at, at the pixels' middles, exact. As one sees it who stands at look_at: rows go down
// along -t, columns along -r.
core::Image DrawIrradiance(std::span<const lightfield::PosedLightField> fields, const Eye& eye,
                           double width_m, double height_m);
// The receiver of a pixel's middle.
lightfield::Vec3 ReceiverOf(const Eye& eye, double width_m, double height_m, int row, int column);

// "-vtv -vp ...": the eye as a Radiance program takes it; none of equirectangular pictures.
std::optional<std::string> RadianceView(const Eye& eye);

}  // namespace luxfield::formats
