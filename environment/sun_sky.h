// Sun and clear sky as an environment map (docs/formats/environment.md, "The sun and the sky";
// docs/theory.md section 8).
//
// The sky is Hosek and Wilkie's (environment/hosek_wilkie.h), divided by the square of the sun's
// distance in au; its horizontal illuminance E_d is the integral of that. The sun is a disc of its
// true size, about 0.53 degrees, and even radiance E_n / (pi sin^2(rho)), rho its angular radius
// and E_n Bird and Riordan's (environment/sunlight.h). Below the horizon lies Lambertian ground:
// albedo / pi times the horizontal illuminance, of the albedo's grey.
//
// With clouds (environment/cloud_layer.h; docs/theory.md section 8 has the sum) the disc is dimmed
// by what its rays meet, the sky is seen through the layer, and the layer sends down what it
// scatters of the sun's, the sky's and the ground's light, in the pattern (1 + 2 cos theta) / 3 of
// the CIE standard overcast sky, beside a forward peak around the sun. The ground is lit by the
// mean over the layer, not by what falls in at the one place.
//
// World frame: x to the east, y to the north, z up. Radiance is luminance, cd m^-2, in linear Rec.
// 709 (core::Luminance of it; divide by 683 lm/W for W sr^-1 m^-2 weighted by V(lambda)), within
// Rec. 709 (IntoGamut).
#pragma once

#include <optional>

#include "luxfield/core/image.h"
#include "luxfield/environment/cloud_layer.h"
#include "luxfield/environment/environment_layouts.h"
#include "luxfield/environment/hosek_wilkie.h"
#include "luxfield/environment/sun_position.h"

namespace luxfield::environment {

class SunSky {
 public:
  // Throws as HosekWilkieSky and CloudLayer. `when` says how far the wind has taken the clouds.
  SunSky(const SunPosition& sun, double turbidity, double ground_albedo);
  SunSky(const SunPosition& sun, double turbidity, double ground_albedo, const CloudOptions& clouds,
         UtcTime when);

  // Of the sky without the sun, or of the ground. A unit direction; with clouds the mean over about
  // `width` radians around it.
  core::Rgb Radiance(lightfield::Vec3 direction, double width = 0) const;
  const core::Rgb& sun_radiance() const { return sun_radiance_; }
  lightfield::Vec3 sun_direction() const { return sun_direction_; }
  double sun_angular_radius() const { return sun_radius_; }  // radians

  // Illuminance, lx. Horizontal is what the whole disc and the sky give: a disc that the horizon
  // cuts gives less.
  const core::Rgb& direct_normal() const { return direct_; }
  const core::Rgb& diffuse_horizontal() const { return diffuse_; }
  core::Rgb global_horizontal() const;
  // What lights the ground: the mean of the above over the layer of clouds.
  const core::Rgb& region_horizontal() const { return region_; }
  // Share of the sky's solid angle that is cloud.
  double cloud_cover() const { return cloud_cover_; }

  // The picture in a layout, `height` rows: 2 : 1, square, or a strip of six. Every pixel holds the
  // mean over what it shows: the sky by 2 x 2 Gauss points, the disc by the exact solid angle that
  // a pixel and the part of the disc above the horizon share, so that the sum over pixels of
  // radiance times solid angle is the disc's, to 1e-6, at any size. Throws InputError for fewer
  // than 32 pixels along a side of the sphere's picture (of a face), or a height no layout has.
  core::Image Picture(EnvironmentLayout layout, int height) const;

 private:
  void Finish(double ground_albedo);
  core::Rgb HorizontalIlluminance();  // of the sky; sets cloud_cover_
  core::Rgb SkyColour(lightfield::Vec3 direction) const;
  core::Rgb CloudedColour(lightfield::Vec3 direction, double width) const;

  HosekWilkieSky sky_;
  std::optional<CloudLayer> clouds_;
  double nearness_ = 1;  // of the sun: 1 / distance^2
  lightfield::Vec3 sun_direction_;
  double sun_radius_ = 0;
  core::Rgb direct_{}, diffuse_{}, region_{}, sun_radiance_{}, ground_radiance_{};
  double cloud_cover_ = 0;
  // With clouds: the sun's beam above them, the horizontal fluxes of sun and sky there, the sunlit
  // share of the air below them and its optical thickness along the vertical.
  core::Rgb beam_{}, sun_flux_{}, sky_flux_{};
  double sunlit_ = 1, air_thickness_ = 0;
};

}  // namespace luxfield::environment
