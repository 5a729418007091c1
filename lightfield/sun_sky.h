// Sun and clear sky as an environment map (docs/formats/environment.md, "The sun and the sky").
//
// Energy by Bird and Riordan (lightfield/clear_sky.h). The sun is a disc of its true size, about
// 0.53 degrees, and even radiance E_n / (pi sin^2(rho)), rho its angular radius. The sky's pattern
// is Perez' formula with Preetham's coefficients (Preetham, Shirley and Smits, "A practical
// analytic model for daylight", SIGGRAPH 1999; Perez, Seals and Michalsky, Solar Energy 50, 1993),
//
//   F(theta, gamma) = (1 + A exp(B / cos theta)) (1 + C exp(D gamma) + E cos^2 gamma),
//
// theta the angle to the zenith and gamma to the sun, for the luminance Y and the chromaticities x,
// y: value = zenith value F(theta, gamma) / F(0, theta_sun). Preetham's own zenith luminance is not
// used: it makes a clear sky up to twice, a low sun's five times as bright as measured. Instead Y
// is scaled until its horizontal illuminance is E_d's. Below the horizon lies Lambertian ground:
// albedo / pi times the horizontal illuminance, of the albedo's grey.
//
// World frame: x to the east, y to the north, z up. Radiance is luminance, cd m^-2, in linear Rec.
// 709 (core::Luminance of it; divide by 683 lm/W for W sr^-1 m^-2 weighted by V(lambda)).
#pragma once

#include <array>

#include "core/image.h"
#include "lightfield/clear_sky.h"
#include "lightfield/environment_layouts.h"
#include "lightfield/sun_position.h"

namespace luxfield::lightfield {

class SunSky {
 public:
  // Throws as FindClearSky.
  SunSky(const SunPosition& sun, double turbidity, double ground_albedo);

  // Of the sky without the sun, or of the ground. A unit direction.
  core::Rgb Radiance(Vec3 direction) const;
  const core::Rgb& sun_radiance() const { return sun_radiance_; }
  Vec3 sun_direction() const { return sun_direction_; }
  double sun_angular_radius() const { return sun_radius_; }  // radians

  // Illuminance, lx. Horizontal is what the whole disc and the sky give: a disc that the horizon
  // cuts gives less.
  const core::Rgb& direct_normal() const { return clear_.direct_normal; }
  const core::Rgb& diffuse_horizontal() const { return diffuse_; }
  core::Rgb global_horizontal() const;

  // The picture in a layout, `height` rows: 2 : 1, square, or a strip of six. Every pixel holds the
  // mean over what it shows: the sky by 2 x 2 Gauss points, the disc by the exact solid angle that
  // a pixel and the part of the disc above the horizon share, so that the sum over pixels of
  // radiance times solid angle is the disc's, to 1e-6, at any size. Throws InputError for fewer
  // than 32 pixels along a side of the sphere's picture (of a face), or a height no layout has.
  core::Image Picture(EnvironmentLayout layout, int height) const;

 private:
  struct Perez {
    std::array<double, 5> c{};  // A to E
    double zenith = 0;          // value over F in the zenith
    double operator()(double cos_theta, double gamma, double cos_gamma) const;
  };
  core::Rgb SkyColour(Vec3 direction) const;

  ClearSky clear_;
  Vec3 sun_direction_;
  double sun_radius_ = 0;
  core::Rgb sun_radiance_{}, ground_radiance_{}, diffuse_{};
  Perez luminance_, x_, y_;
  double scale_ = 1;
};

}  // namespace luxfield::lightfield
