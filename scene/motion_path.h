// How a camera and lamps move over time: a path.toml (docs/formats/path.md).
//
// Each of them has keys, values at times that rise. Between two keys positions and angles are cubic
// (Hermite), with the derivative at a key that a parabola through it and its neighbours has:
//
//   m_i = (h_(i-1) d_i + h_i d_(i-1)) / (h_(i-1) + h_i)
//
// with h_i = t_(i+1) - t_i and d_i = (v_(i+1) - v_i) / h_i; at the ends that of the outermost three
// keys' parabola. What moves with constant acceleration is met exactly. A lamp's scale is linear.
// Before the first key and after the last, values stay.
//
//   const MotionPath path = ReadMotionPath("path.toml");
//   for (int n = 0; n < path.frame_count(); ++n) PlacementAt(path, path.time_s(n), scene);
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/scene/scene.h"
#include "luxfield/scene/transform.h"

namespace luxfield::scene {

// As LookAt; empty where `target` is `position`, or the line between them parallel to `up`.
std::optional<Pose> Facing(Vec3 position, Vec3 target, Vec3 up);

// A luminaire of the scene, in the scene's order.
struct PlacedLamp {
  Pose world_from_luminaire;
  double scale = 1;
  core::Rgb colour = {1, 1, 1};
};

// Where things stand in one picture.
struct Placement {
  Camera camera;
  std::vector<PlacedLamp> lamps;
};

struct CameraKey {
  double t_s = 0;
  lightfield::Vec3 position, look_at;           // world, metres
  std::optional<double> vertical_fov_deg = {};  // empty: the scene's
};

struct LampKey {
  double t_s = 0;
  lightfield::Vec3 position;  // of the filter plane's middle; world, metres
  // Where its axis goes, or its rotation as scene.toml has it; neither: as it stands in the scene.
  // All keys of a lamp have the same of them.
  std::optional<lightfield::Vec3> look_at = {}, rotate_deg = {};
  std::optional<double> scale = {};  // empty: the scene's
};

struct MovedLamp {
  std::string name;  // of a luminaire of the scene
  std::vector<LampKey> keys;
};

struct MotionPath {
  std::string file;  // for messages
  double frames_per_s = 24;
  double duration_s = 0;
  lightfield::Vec3 up{0, 0, 1};   // of camera and lamps that look at a point
  std::vector<CameraKey> camera;  // empty: it stays where the scene has it
  std::vector<MovedLamp> lamps;

  // Both ends of the time are frames.
  int frame_count() const;
  double time_s(int frame) const { return frame / frames_per_s; }
};

// Throws InputError naming file and field.
MotionPath ReadMotionPath(const std::filesystem::path& path);

// Where camera and lamps are at that time; what does not move is where the scene has it. Throws
// InputError for lamps that the scene does not have, or has several of, and where something stands
// at the point that it looks at, or looks along `up`.
Placement PlacementAt(const MotionPath& path, double t_s, const Scene& scene);

// Of the path's frames, in their order; InputError as PlacementAt.
std::vector<Placement> PlacementsOf(const MotionPath& path, const Scene& scene);

}  // namespace luxfield::scene
