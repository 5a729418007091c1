// The viewer: a document in a window until that is closed, or until it has been photographed.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "luxfield/view/documents/scene_document.h"
#include "luxfield/view/picture/look.h"
#include "luxfield/view/picture/reading.h"

namespace luxfield::view {

struct ViewerOptions {
  SceneOptions input;
  WindowSize size{1280, 800};
  bool wait = false;  // for a session that is not there yet
  bool bare = false;  // the picture alone, without panels
  std::optional<Look> look;
  std::filesystem::path reference;  // radiance that Layer::kLab compares with; empty: none
  // Not empty: the window's picture is written there as a PNG, and the viewer ends: after `frames`
  // frames that show what was opened, or when it will not change any more; `until_closed`: when it is
  // closed, and will not change any more.
  std::filesystem::path screenshot;
  std::optional<int> frames;
  bool until_closed = false;
  struct Pixel {
    int column = 0, row = 0;
  };
  std::vector<Pixel> reads;  // pixels of the picture to be read at the end
};

struct ViewerResult {
  std::optional<Failure> failure;  // why nothing could be shown
  int frames = 0;                  // drawn since there was something to show
  bool settled = false;
  WindowSize picture;           // 0 x 0: there was none
  std::optional<double> error;  // estimated, of its luminance
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  std::vector<Reading> readings;  // that were asked for
  std::vector<Reading> probes;    // that stand on the picture
};

// Throws DeviceError where no window can be opened or the screenshot not be written.
ViewerResult RunViewer(const ViewerOptions& options);

}  // namespace luxfield::view
