// How long pictures take while something moves, and until an error is reached: `view --bench`.
#pragma once

#include <string>
#include <vector>

#include "luxfield/view/lighting/load_scene.h"

namespace luxfield::view {

struct FrameTimesOptions {
  SceneOptions input;
  SceneKind kind = SceneKind::kScene;
  int frames = 20;  // of each case; medians count
};

// Of whole pictures, medians over the frames. Core-seconds are CPU time of all threads.
struct MovingTimes {
  std::string moving;  // "camera" or "lamps"
  bool shadows = false;
  double frame_s = 0, core_s = 0;  // all of a frame but its way to the screen
  // Parts of core_s: lighting by the device's threads with what reads pictures back (primary
  // visibility, shadow maps, lamps), and colours for the screen.
  double picture_core_s = 0, colours_core_s = 0;
  // By the renderer's own clock, parts of frame_s.
  double primary_s = 0, lighting_s = 0;
};

// The way to the first picture, which has as many pixels as a window's: parts that follow each other.
struct FirstTimes {
  double scene_s = 0;    // reading the scene and its meshes
  double device_s = 0;   // opening the device
  double lamps_s = 0;    // reading light fields, maps and tables, and giving them to the device
  double tables_s = 0;   // kernels, and tables of this view that are not on disk
  double picture_s = 0;  // once all tables are in memory
  double Sum() const { return scene_s + device_s + lamps_s + tables_s + picture_s; }
};

struct FrameTimes {
  int width = 0, height = 0;
  std::string device;
  FirstTimes first;
  std::vector<MovingTimes> moving;
  double refined_s = 0, refined_core_s = 0;  // from rest until the error asked for
  double refined_error = 0, samples = 0;
};

// The camera orbits by half a degree a frame, lamps move a centimetre; two frames come first and do
// not count. Throws InputError, DeviceError.
FrameTimes MeasureFrameTimes(const FrameTimesOptions& options);

}  // namespace luxfield::view
