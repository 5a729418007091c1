// A lamp's far field: luminous intensity by direction, as photometric files hold it (LM-63,
// EULUMDAT, TM-33, GLDF). Axes: docs/axes.md.
//
// Type C, the usual one, counts planes by C and angles in a plane by gamma:
//
//   direction (u, v, z) = (sin gamma cos C, -sin gamma sin C, cos gamma)
//
// Types A and B count the horizontal angle H (planes_deg) and the vertical angle V (angles_deg):
//
//   A: (cos V cos H,  cos V sin H, -sin V)        planes share the vertical axis, V from -90 at nadir
//   B: (cos H sin V,  sin H,  cos H cos V)        planes share a horizontal axis, V = 0 at nadir
//
// Between the tabulated angles intensity is bilinear in the table's own two angles, over 360 degrees
// of C without a seam; beyond the first and last of the others it is 0. Flux is the exact integral
// of that function:
//
//   Phi = sum_ij p_i a_j I_ij
//
// where along the angle a that carries the solid angle's sine or cosine (gamma of type C, V of A, H
// of B) the weights are integrals of hat functions, for type C on [a, b]
//
//   integral (b - x) sin x / (b - a) dx = cos a - (sin b - sin a) / (b - a)
//   integral (x - a) sin x / (b - a) dx = (sin b - sin a) / (b - a) - cos b
//
// and the trapezoidal ones along the other.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::formats {

enum class PhotometryType { kC, kB, kA };

// The luminous opening. Extents are those of its bounding box: along C0-C180 (u), along C90-C270
// (v) and along the vertical axis.
struct Opening {
  enum class Shape {
    kPoint,
    kBox,      // a rectangle where the height is 0
    kEllipse,  // a disc where both extents are equal; with height, a vertical cylinder
    kCylinderAlongC0,
    kCylinderAlongC90,
    kEllipsoid,     // a sphere where all extents are equal
    kVerticalDisc,  // faces C0
  };
  Shape shape = Shape::kPoint;
  double c0_m = 0, c90_m = 0, height_m = 0;
};

// "a disc of 120 mm", "a rectangle of 600 mm (C0) x 300 mm (C90)".
std::string Describe(const Opening& opening);

struct LampSet {
  int count = 1;
  std::string type;
  double flux_lm = 0;  // of all lamps of the set together
  std::string colour, colour_rendering;
  double watts = 0;
};

// LM-63: by how much lamps change as the luminaire is tilted.
struct Tilt {
  int lamp_geometry = 1;
  std::vector<double> angles_deg, factors;
};

struct Photometry {
  std::string format;  // "LM-63-2002", "EULUMDAT", "TM-33-23"
  PhotometryType type = PhotometryType::kC;
  // Type C: in [0, 360), ascending; one plane stands for all. Types A and B: H, ascending.
  std::vector<double> planes_deg;
  std::vector<double> angles_deg;    // ascending
  std::vector<double> intensity_cd;  // [plane][angle], all factors of the file applied

  bool absolute = false;                 // measured, not scaled to the lamps' flux
  std::optional<double> stated_flux_lm;  // the luminaire's, by the header
  std::optional<double> lamp_flux_lm;    // the bare lamps', by the header
  double input_watts = 0;                // 0: not stated
  Opening opening;
  std::array<double, 3> housing_m{};  // along C0, along C90, height; 0: not stated
  std::vector<LampSet> lamps;
  std::optional<Tilt> tilt;
  // LM-63's names (MANUFAC, LUMINAIRE, ISSUEDATE ...), in the file's order; "" for an unnamed line.
  std::vector<std::pair<std::string, std::string>> keywords;
  std::vector<std::string> odd;  // what a person should know of the file, a sentence each

  double at(std::size_t plane, std::size_t angle) const {
    return intensity_cd[plane * angles_deg.size() + angle];
  }
  std::string keyword(const std::string& name) const;  // the first of that name, or ""
};

// Throws InputError naming `file` unless sizes fit, angles ascend within the type's range and
// intensities are finite.
void Validate(const Photometry& photometry, const std::string& file);

// Intensity in cd in a direction of the luminaire's frame, any but 0.
double Intensity(const Photometry& photometry, lightfield::Vec3 direction);

// Unit direction of a table's angles.
lightfield::Vec3 Direction(PhotometryType type, double plane_deg, double angle_deg);

double Flux(const Photometry& photometry);

struct Peak {
  double intensity_cd = 0, plane_deg = 0, angle_deg = 0;
};
Peak FindPeak(const Photometry& photometry);

// Mirror planes that the table of type C has.
struct Symmetry {
  bool rotational = false;
  bool about_c0 = false;   // I(C) = I(360 - C): the plane C0-C180 is a mirror
  bool about_c90 = false;  // I(C) = I(180 - C)
};
// Intensities that differ by up to `tolerance` of the largest are equal.
Symmetry FindSymmetry(const Photometry& photometry, double tolerance = 1e-6);
std::string Describe(const Symmetry& symmetry);

// Adds to planes on one side of a mirror, C = about_deg and its opposite, those on the other side.
// Throws InputError naming `file` where the given planes lie on both sides.
void MirrorPlanes(Photometry& photometry, double about_deg, const std::string& file);

// Takes planes as a file lists them, up to and with C360: sorts, drops the closing plane, says in
// `odd` what is inconsistent (C360 unlike C0, gamma = 0 not the same in all planes).
void ClosePlanes(Photometry& photometry);

// Planes of type C in ascending order as LM-63 and TM-33 store them, completed by the symmetry that
// their range stands for: 0 alone, 0 to 90, 0 to 180, 90 to 270, 0 to 360. A range that lacks the
// closing plane alone is told in `odd`. Throws InputError naming `file` for any other.
void CompletePlanesOfTypeC(Photometry& photometry, const std::string& file);

// The smallest of these ranges that the table's symmetry allows; {0, 360} also where planes of its
// edges are missing.
struct PlaneRange {
  double first = 0, last = 360;
};
PlaneRange StoredRange(const Photometry& photometry);

// The same lamp as type C at these angles, by Intensity.
Photometry ResampledToTypeC(const Photometry& photometry, const std::vector<double>& planes_deg,
                            const std::vector<double>& angles_deg);

}  // namespace luxfield::formats
