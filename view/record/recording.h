// A flight through a scene, or a lamp's motion, as files: no window, no display.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "luxfield/view/lighting/load_scene.h"
#include "luxfield/view/picture/look.h"

namespace luxfield::view {

struct RecordOptions {
  SceneOptions input;          // a scene or a light field
  std::filesystem::path path;  // path.toml
  // A folder, for frame_0000.exr and frame_0000.png and so on, or a video's name.
  std::filesystem::path output;
  bool preview = false;  // pictures as they are while something moves, instead of refined ones
  Look look;             // of PNGs and the video
};

struct RecordedFrame {
  double t_s = 0;
  double samples = 0;           // light samples a pixel
  std::optional<double> error;  // estimated relative RMSE of the luminance, where it is known
};

struct Recording {
  int width = 0, height = 0;
  double frames_per_s = 0;
  std::vector<RecordedFrame> frames;
};

// Frames of a folder come into being one by one; a video does when it is whole. The exponential
// operator's mean and the false colours' range, where the look does not say, are the first frame's,
// so that brightness does not pump. Throws InputError, DeviceError, Interrupted.
Recording Record(const RecordOptions& options);

}  // namespace luxfield::view
