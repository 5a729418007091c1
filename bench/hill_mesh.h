// A mesh of ours of any size: wooded hills, which hide much of themselves.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/scene/geometry.h"
#include "luxfield/scene/scene.h"

namespace luxfield::bench {

// A square of 20 m x 20 m of some `triangles` triangles (the next smaller 2 n^2), z up, of heights
// from long waves and from spikes that get ever smaller; one Lambertian material.
scene::Geometry HillMesh(int triangles);

// From beside the square over most of it.
scene::Camera HillCamera(int width, int height);

// The beginning of a scene.toml: that camera, and a grey mesh of the file.
std::string HillScene(const std::string& file);

// The vertices and triangles as a binary PLY, little endian.
void WritePly(const std::filesystem::path& path, const scene::Geometry& geometry);

}  // namespace luxfield::bench
