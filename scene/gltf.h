// A glTF 2.0 file (.gltf, .glb) as its JSON and the bytes that this refers to: what assimp, which
// reads the triangles, leaves out. References: glTF 2.0 specification; EXT_mesh_gpu_instancing.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/json.h"
#include "luxfield/scene/texture.h"
#include "luxfield/scene/transform.h"

namespace luxfield::scene {

class Gltf {
 public:
  // By the file's name.
  static bool Is(const std::filesystem::path& path);

  // Throws InputError: no glTF 2.0 file, node trees with a loop or deeper than kDeepestNodes, an
  // extension without which the file's triangles cannot be read (quantised or packed vertices).
  explicit Gltf(const std::filesystem::path& path);

  static constexpr int kDeepestNodes = 1000;

  const core::Json& json() const { return json_; }
  // json()[list][index].
  const core::Json& Element(const std::string& list, std::size_t index) const;

  // The nodes of the file's scene.
  std::vector<std::size_t> RootNodes() const;
  static std::vector<std::size_t> Children(const core::Json& node, const std::string& file);

  // node_from_instance of a node's mesh: the identity alone unless EXT_mesh_gpu_instancing places
  // it several times.
  std::vector<Transform> Instances(const core::Json& node) const;

  // The elements of an accessor of `components` numbers each, normalised integers as glTF 2.0, 3.11
  // defines them.
  std::vector<std::array<double, 4>> Values(std::size_t accessor, int components) const;

  // An image of the file, or beside it.
  Texture Image(std::size_t image, Alpha alpha) const;

  // What the file asks for and luxfield leaves out, in words, of the file's own materials or
  // without regard to them.
  std::vector<std::string> LeftOut(bool own_materials) const;

  // The file's length, with those of the buffers beside it.
  std::uintmax_t Bytes() const;

  std::string file() const { return path_.string(); }
  [[noreturn]] void Fail(const std::string& problem) const;

 private:
  void CheckNodes() const;
  std::span<const unsigned char> BufferView(std::size_t view) const;
  const std::string& Buffer(std::size_t buffer) const;
  std::string Resource(const std::string& uri) const;  // a data: URI's bytes, or a file's

  std::filesystem::path path_;
  core::Json json_;
  std::string glb_buffer_;
  mutable std::map<std::size_t, std::string> buffers_;  // those read so far
};

// json[key] as T, `fallback` where the key is absent.
template <typename T>
T FieldOr(const core::Json& json, const std::string& key, const T& fallback,
          const std::string& file) {
  return json.is_object() && json.contains(key) ? core::Field<T>(json, key, file) : fallback;
}

// json["extensions"][name], null if it is absent.
const core::Json* Extension(const core::Json& json, const std::string& name);

}  // namespace luxfield::scene
