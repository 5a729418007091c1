// What a picture says at one of its pixels.
#pragma once

#include <optional>
#include <string>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/render/film/frame.h"

namespace luxfield::view {

struct Reading {
  int column = 0, row = 0;
  // Luminance of the radiance, and of the irradiance where the picture holds one and something was
  // hit; Frame's units.
  double luminance = 0;
  std::optional<double> illuminance;
  // Standard deviation of `luminance` by the estimator's own variance, where the picture holds it:
  //   sqrt(mean of v_k n_k over the 3 x 3 pixels k around it that took samples / n)
  // for variances v and light samples n; sqrt(v) where the picture does not tell samples.
  std::optional<double> luminance_sigma;
  std::optional<lightfield::Vec3> position;  // world, metres; where something was hit
  std::optional<lightfield::Vec3> normal;    // likewise, towards the camera
  // By the noise of the lamps' measurement, over `illuminance`, of a point that sees all of them.
  std::optional<double> measured_rel_sigma;

  // Standard deviation of `illuminance` by the estimator: as `luminance_sigma` over the luminance,
  // which it is on matt surfaces.
  std::optional<double> IlluminanceSigma() const;
};

// A place in a picture of any size, 0 to 1 from the left and from the top.
struct PicturePlace {
  double x = 0, y = 0;
};

// Empty outside of the picture.
std::optional<Reading> ReadAt(const render::Frame& frame, int column, int row);

// At a place; column and row are those of a picture of width x height, of which `frame`, a preview,
// may have fewer pixels.
std::optional<Reading> ReadAtPlace(const render::Frame& frame, PicturePlace place, int width,
                                   int height);

// "12.34 +- 0.11": to the second digit of sigma (cli/reports/rounded_number.h); the value alone, to
// four digits, where that is not known.
std::string WithSigma(double value, const std::optional<double>& sigma);

// "(120, 44)  12.34 +- 0.11 cd/m2  45.60 +- 0.41 lx (direct light only)  measured to 0.5 %  at
// 0.120 1.400 0.000 m": `+-`, what the lamps were measured to and the place where they are known.
// Irradiance of direct light alone is what this program lights with.
std::string Describe(const Reading& reading, lightfield::FluxUnit unit);

}  // namespace luxfield::view
