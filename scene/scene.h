// scene.toml (docs/formats/scene.md): what is lit, by what, seen from where. Metres, right-handed
// world frame.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/environment/environment_layouts.h"
#include "luxfield/scene/geometry.h"
#include "luxfield/scene/transform.h"

namespace luxfield::scene {

// A pinhole. Pixel (row, column) looks, with orthonormal axes, along
//
//   forward + (2 (column + 0.5) / width - 1) aspect tan(fov/2) right
//           + (1 - 2 (row + 0.5) / height) tan(fov/2) up
struct Camera {
  Vec3 position;
  Vec3 right, up, forward;
  double vertical_fov_deg = 40;
  int width = 1024, height = 768;

  // `up_hint` need not be perpendicular to the view. InputError-free: the reader checks.
  static Camera LookAt(Vec3 position, Vec3 target, Vec3 up_hint, double vertical_fov_deg, int width,
                       int height);
  // Not normalised; column and row are continuous, 0.5 is the centre of the first pixel.
  Vec3 Direction(double column, double row) const;
};

// The factors of a light's channels, which is dimmed and coloured.
inline core::Rgb ChannelScale(double scale, const core::Rgb& colour) {
  return {scale * colour[0], scale * colour[1], scale * colour[2]};
}

struct Luminaire {
  std::string name;                   // of an array's: all have the same
  std::filesystem::path light_field;  // .lf.exr
  std::filesystem::path tables;       // .tab.exr, empty: none given
  Pose world_from_luminaire;
  double scale = 1;              // multiplies its light
  core::Rgb colour = {1, 1, 1};  // and each of its channels, linear Rec. 709
};

enum class AreaLightKind { kRectangle, kSphere };

// Of one radiance L, everywhere and in all directions of its outer side. Neither seen nor in the
// way.
struct AreaLight {
  std::string name;  // of an array's: all have the same
  AreaLightKind kind = AreaLightKind::kRectangle;
  std::array<double, 3> radiance{};  // linear Rec. 709, in the luminaires' unit / (sr m^2)
  Pose world_from_light;             // origin: its centre; the rectangle shines along +z
  double width_m = 0, height_m = 0;  // rectangle: along x and y
  double radius_m = 0;               // sphere
};

enum class ClassicalModel { kPoint, kLinear, kArea };

// A far field that leaves every point of an extent alike (docs/theory.md 15): what a photometric
// file says of a lamp, and most lamps have nothing better. Neither seen nor in the way.
struct ClassicalLight {
  std::string name;  // of an array's: all have the same
  ClassicalModel model = ClassicalModel::kPoint;
  std::filesystem::path distribution;  // LM-63, EULUMDAT, TM-33 or GLDF
  // Of the extent along x and y; one of a linear light's is 0, a point has none. Empty: the file's
  // luminous opening.
  std::optional<std::array<double, 2>> size_m;
  Pose world_from_light;         // origin: the middle of its extent, in the plane z = 0
  double scale = 1;              // multiplies its light
  core::Rgb colour = {1, 1, 1};  // and each channel of it, which is as much in all
};

struct Environment {
  std::filesystem::path file;                            // .hdr or .exr
  std::optional<environment::EnvironmentLayout> layout;  // empty: the file's
  Pose world_from_environment;                           // a rotation
  double scale = 1;                                      // multiplies its radiance
  int face_size = 0;  // texels along a face of its cube map, 0: as fine as the picture
};

// What a mesh file asks for and luxfield leaves out, in words.
struct LeftOut {
  std::filesystem::path file;
  std::vector<std::string> features;
};

struct Scene {
  std::filesystem::path file;
  Geometry geometry;
  Camera camera;
  std::vector<Luminaire> luminaires;
  std::vector<AreaLight> area_lights;
  std::vector<ClassicalLight> classical_lights;
  std::optional<Environment> environment;
  std::vector<LeftOut> left_out;  // one a file; empty: nothing is left out
};

// What the command line changes. Luminaires are named as in the file, "*" means all of them; paths
// are as given (not relative to the scene).
struct SceneOverrides {
  std::map<std::string, std::filesystem::path> light_fields;
  std::map<std::string, std::filesystem::path> tables;
  std::optional<int> width, height;
};

// Reads a scene and its meshes. A light field given anew drops the file's tables, which belong to
// another. Files of luminaires and environments are not opened here. Warns on stderr of what meshes
// leave out and of lengths beyond a kilometre. Throws InputError naming file and field.
Scene ReadScene(const std::filesystem::path& path, const SceneOverrides& overrides = {});

}  // namespace luxfield::scene
