// A light field as a light source of Radiance (Ward 1994, "The RADIANCE lighting simulation and
// rendering system"), without a plugin.
//
// Radiance interpolates data files of up to five dimensions multilinearly ("The RADIANCE Reference
// Manual", brightdata). That gives the sum of docs/theory.md 2 exactly: the data are C over
// (j, i, row, column), rows and columns are asked for at whole numbers, where nothing is
// interpolated, and along j and i the basis functions are what linear interpolation makes of C. With
// k the knot cell of u, f the way through it, and C(y) the linear interpolation of C_i, zero beyond
// its ends,
//
//   box        C(k)
//   bilinear   C(k - 1 + f)
//   quadratic  S C(k - 1 + f (1 - a (1 - f)) / S),   S = 1 - 2 a f (1 - f)
//   bspline2   (1 - f) C(k - 3/2 + f/2) + f C(k - 1 + f/2)
//
// The last is de Boor's algorithm (1972) for the quadratic B-spline; a mixfunc of Radiance mixes its
// two places, per axis. What is left is Radiance's own quadrature over the source, which its options
// -ds and -dj govern.
//
// Radiance leaves out light of a source that is below zero.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::bridges {

// lm per W with which Radiance counts luminance ("The RADIANCE File Formats").
inline constexpr double kRadianceEfficacy = 179;

struct RadianceSource {
  std::vector<std::filesystem::path> files;  // the scene description first
  int polygons = 0;
  // Flux of negative coefficients over that of positive ones: at most what Radiance leaves out.
  double negative_share = 0;
};

// Writes NAME.rad with a polygon for each knot cell on F that shines, in the luminaire's frame, and
// beside it NAME.rad.cal and NAME.rad.dat (of three channels NAME.rad.r.dat, .g.dat, .b.dat; of
// several fields NAME.rad.0.cal and so on). Of lm radiance is luminance / 179; of W and of relative fields it is
// as it is. Three channels become those of Radiance's primaries, without adaptation, so that
// luminance and chromaticity stay. Holds one line of numbers beside the fields. Throws InputError
// naming `path` where its name has other characters than letters, digits, '.', '_' and '-', and
// naming `source` where it has no light or more values than Radiance's int counts; and where a file
// beside it would take the place of another (core::RequireOwn).
//
//   WriteRadianceSource("lamp.rad", lightfield::ReadLightFields("lamp.lf.exr"), "lamp.lf.exr");
RadianceSource WriteRadianceSource(const std::filesystem::path& path,
                                   std::span<const lightfield::PosedLightField> fields,
                                   const std::string& source);

}  // namespace luxfield::bridges
