// Sun and clear sky as an environment map (docs/formats/environment.md, "The sun and the sky";
// docs/theory.md section 8).
//
// The sky is Hosek and Wilkie's (lightfield/hosek_wilkie.h), divided by the square of the sun's
// distance in au; its horizontal illuminance E_d is the integral of that. The sun is a disc of its
// true size, about 0.53 degrees, and even radiance E_n / (pi sin^2(rho)), rho its angular radius
// and E_n Bird and Riordan's (lightfield/sunlight.h). Below the horizon lies Lambertian ground:
// albedo / pi times the horizontal illuminance, of the albedo's grey.
//
// World frame: x to the east, y to the north, z up. Radiance is luminance, cd m^-2, in linear Rec.
// 709 (core::Luminance of it; divide by 683 lm/W for W sr^-1 m^-2 weighted by V(lambda)), within
// Rec. 709 (IntoGamut).
#pragma once

#include "core/image.h"
#include "lightfield/environment_layouts.h"
#include "lightfield/hosek_wilkie.h"
#include "lightfield/sun_position.h"

namespace luxfield::lightfield {

class SunSky {
 public:
  // Throws as HosekWilkieSky.
  SunSky(const SunPosition& sun, double turbidity, double ground_albedo);

  // Of the sky without the sun, or of the ground. A unit direction.
  core::Rgb Radiance(Vec3 direction) const;
  const core::Rgb& sun_radiance() const { return sun_radiance_; }
  Vec3 sun_direction() const { return sun_direction_; }
  double sun_angular_radius() const { return sun_radius_; }  // radians

  // Illuminance, lx. Horizontal is what the whole disc and the sky give: a disc that the horizon
  // cuts gives less.
  const core::Rgb& direct_normal() const { return direct_; }
  const core::Rgb& diffuse_horizontal() const { return diffuse_; }
  core::Rgb global_horizontal() const;

  // The picture in a layout, `height` rows: 2 : 1, square, or a strip of six. Every pixel holds the
  // mean over what it shows: the sky by 2 x 2 Gauss points, the disc by the exact solid angle that
  // a pixel and the part of the disc above the horizon share, so that the sum over pixels of
  // radiance times solid angle is the disc's, to 1e-6, at any size. Throws InputError for fewer
  // than 32 pixels along a side of the sphere's picture (of a face), or a height no layout has.
  core::Image Picture(EnvironmentLayout layout, int height) const;

 private:
  core::Rgb SkyColour(Vec3 direction) const;

  HosekWilkieSky sky_;
  double nearness_ = 1;  // of the sun: 1 / distance^2
  Vec3 sun_direction_;
  double sun_radius_ = 0;
  core::Rgb direct_{}, diffuse_{}, sun_radiance_{}, ground_radiance_{};
};

}  // namespace luxfield::lightfield
