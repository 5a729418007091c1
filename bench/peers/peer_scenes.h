// Scenes that other renderers can show, too: a mesh of hills under four kinds of light.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::bench {

struct PeerSceneOptions {
  std::filesystem::path folder;        // where they are written
  std::filesystem::path distribution;  // .ies of the photometric lamp
  int triangles = 0;                   // of the mesh, about
};

// "environment mesh" (the sun and sky of an afternoon), "area light" (4 m x 3 m), "spot lights" (100,
// whose intensity is even up to 25 degrees and falls linearly to 0 at 40), "IES lamp" (a point of the
// photometric file).
const std::vector<std::string>& PeerSceneNames();

// Writes the scene and what it names, and returns the scene.toml.
std::filesystem::path WritePeerScene(const std::string& name, const PeerSceneOptions& options);

}  // namespace luxfield::bench
