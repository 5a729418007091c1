// What luxfield leaves out of a glTF file, in words.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "luxfield/scene/gltf.h"

namespace luxfield::scene {
namespace {

using core::Json;

// Those that are read, those whose parts are named one by one below, and those without effect on
// what is seen here.
constexpr const char* kSilent[] = {"EXT_mesh_gpu_instancing",
                                   "KHR_texture_transform",
                                   "KHR_materials_pbrSpecularGlossiness",
                                   "KHR_materials_emissive_strength",
                                   "KHR_draco_mesh_compression",
                                   "EXT_texture_webp",
                                   "KHR_lights_punctual"};

// Elements of json[list], objects, for which `is` holds.
template <typename Is>
std::size_t Count(const Json& json, const std::string& list, const Is& is) {
  const auto found = json.find(list);
  if (found == json.end() || !found->is_array()) return 0;
  return static_cast<std::size_t>(std::count_if(
      found->begin(), found->end(), [&](const Json& e) { return e.is_object() && is(e); }));
}

bool Emits(const Json& material) {
  const auto factor = material.find("emissiveFactor");
  return factor != material.end() && factor->is_array() &&
         std::any_of(factor->begin(), factor->end(),
                     [](const Json& x) { return x.is_number() && x.get<double>() > 0; });
}

bool IsSeeThrough(const Json& material) {
  const auto mode = material.find("alphaMode");
  return mode != material.end() && *mode != "OPAQUE";
}

bool AnyPrimitive(const Json& mesh, const std::function<bool(const Json&)>& is) {
  return Count(mesh, "primitives", is) > 0;
}

bool Clamps(const Json& sampler) {
  constexpr int kRepeat = 10497;
  const auto wraps = [&](const char* key) {
    const auto mode = sampler.find(key);
    return mode != sampler.end() && *mode != kRepeat;
  };
  return wraps("wrapS") || wraps("wrapT");
}

std::string Plural(std::size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : noun == "mesh" ? "es" : "s");
}

}  // namespace

std::vector<std::string> Gltf::LeftOut(bool own_materials) const {
  std::vector<std::string> left_out;
  const auto add = [&](std::size_t count, const std::string& noun, const std::string& what) {
    if (count > 0) left_out.push_back(fmt::format("{} of {}", what, Plural(count, noun)));
  };
  const auto any = [](const Json&) { return true; };
  if (const Json* lights = Extension(json_, "KHR_lights_punctual"))
    add(Count(*lights, "lights", any), "lamp", "the light (KHR_lights_punctual)");
  if (own_materials) {
    add(Count(json_, "materials", Emits), "material",
        "the light that falls on others (emissiveFactor; the camera sees it)");
    add(Count(json_, "materials", IsSeeThrough), "material", "transparency (alphaMode)");
    add(Count(json_, "materials", [](const Json& m) { return m.contains("occlusionTexture"); }),
        "material", "occlusionTexture");
    add(Count(json_, "meshes",
              [](const Json& mesh) {
                return AnyPrimitive(mesh, [](const Json& primitive) {
                  const auto attributes = primitive.find("attributes");
                  return attributes != primitive.end() && attributes->contains("COLOR_0");
                });
              }),
        "mesh", "vertex colours (COLOR_0)");
    add(Count(json_, "samplers", Clamps), "sampler", "clamping and mirroring");
  }
  add(Count(json_, "meshes",
            [](const Json& mesh) {
              return AnyPrimitive(mesh, [](const Json& p) { return p.contains("targets"); });
            }),
      "mesh", "morph targets");
  add(Count(json_, "skins", any), "skin", "the pose");
  add(Count(json_, "animations", any), "animation", "the movement");
  for (const auto& name : FieldOr<std::vector<std::string>>(json_, "extensionsUsed", {}, file())) {
    const bool of_materials =
        name.find("_material") != std::string::npos || name.find("_texture") != std::string::npos;
    if (std::find(std::begin(kSilent), std::end(kSilent), name) == std::end(kSilent) &&
        (own_materials || !of_materials))
      left_out.push_back(name);
  }
  return left_out;
}

}  // namespace luxfield::scene
