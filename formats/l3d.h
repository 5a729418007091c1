// A luminaire's shape as L3D files hold it (docs/formats/photometric-files.md): a ZIP archive of
// structure.xml and Wavefront meshes, on its own or in a GLDF container. Read is where light leaves
// the luminaire; the rest of the meshes is not.
//
// L3D's frame has z up, and its objects shine along their own -z. Here all is in the luminaire's
// frame (docs/axes.md):
//
//   (u, v, z) = (x, -y, -z)
//
// A part's Rotation turns about its own z, then x, then y: R = R_z R_x R_y. Joints are taken as
// they stand by default.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// A rectangle or a disc whose light the photometry describes.
struct EmittingObject {
  std::string name;
  bool round = false;
  double x_m = 0, y_m = 0;              // along its own axes; the diameter twice where it is round
  std::array<double, 4> heights_m{};    // luminous heights towards C0, C90, C180, C270
  lightfield::Vec3 centre_m;            // in the luminaire's frame, as the following
  lightfield::Vec3 x_axis{1, 0, 0};     // unit
  lightfield::Vec3 direction{0, 0, 1};  // unit, where it shines
};

// Faces of a mesh that are shown as shining.
struct EmittingSurface {
  std::string name;
  std::vector<std::string> objects;  // names of those it belongs to
  std::size_t faces = 0;
  double area_m2 = 0;
  lightfield::Vec3 direction;  // sum of area times normal over area_m2; 1 long where it is flat
};

struct LampShape {
  std::vector<EmittingObject> objects;
  std::vector<EmittingSurface> surfaces;
  std::vector<std::string> odd;  // as Photometry's
};

// `file` is for messages. Throws InputError naming file, member and line: what ZipReader and
// ParseXml refuse, meshes of more than 64 MiB together, faces and objects that are not there.
LampShape ParseL3d(std::string_view bytes, const std::string& file);

// A luminous opening about `middle_m` as an L3D file: a box, whose face towards +z shines, with
// height its sides too, or a disc. None of a point and of the other shapes, which L3D's objects
// cannot say.
std::optional<std::string> FormatL3d(const Opening& opening, lightfield::Vec3 middle_m,
                                     const std::string& creator);

// The name of FormatL3d's object, to which a GLDF's emitter refers.
inline constexpr const char* kEmittingObject = "opening";

}  // namespace luxfield::formats
