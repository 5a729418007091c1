// A scene that is lit while it is looked at.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "luxfield/view/documents/document.h"

namespace luxfield::view {

struct SceneOptions {
  std::filesystem::path file;
  std::optional<int> width, height;  // of the picture instead of the scene's
  double error = 0.005;
  bool shadows = true;
  std::string device;
  int threads = 0;
  std::uint64_t seed = 1;
};

// Loads in the background; what is wrong with the file is the document's failure().
std::unique_ptr<Document> OpenScene(const SceneOptions& options);

// The same of a light field alone, on the stage of view/lighting/stage.h with a slider for its distance.
std::unique_ptr<Document> OpenLightField(const SceneOptions& options);

}  // namespace luxfield::view
