#include "luxfield/scene/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"

namespace luxfield::scene {
namespace {

using core::Json;

constexpr char kSpecularGlossiness[] = "KHR_materials_pbrSpecularGlossiness";
constexpr double kBrightest = 1e12;  // cd / m^2; as a scene's lights

// A placement's rows from KHR_texture_transform's translation * rotation * scale. It maps
// (u, 1 - v) to (u', 1 - v'), since glTF's v runs downwards; the rotation is counter-clockwise as
// the picture is seen, as in the extension's example.
void Place(const Json& transform, const Gltf& gltf, TexturePlacement& placement) {
  using Pair = std::vector<double>;
  const auto offset = FieldOr<Pair>(transform, "offset", {0, 0}, gltf.file()),
             scale = FieldOr<Pair>(transform, "scale", {1, 1}, gltf.file());
  const auto rotation = FieldOr<double>(transform, "rotation", 0, gltf.file());
  if (offset.size() != 2 || scale.size() != 2) gltf.Fail("KHR_texture_transform takes two numbers");
  const double c = std::cos(rotation), s = std::sin(rotation);
  const double rows[2][3] = {
      {c * scale[0], -s * scale[1], offset[0] + s * scale[1]},
      {s * scale[0], c * scale[1], 1 - offset[1] - c * scale[1]},
  };
  for (std::size_t row = 0; row < 2; ++row)
    for (std::size_t k = 0; k < 3; ++k) {
      if (!std::isfinite(rows[row][k])) gltf.Fail("a KHR_texture_transform is not finite");
      placement.rows[row][k] = static_cast<float>(rows[row][k]);
    }
}

}  // namespace

struct GltfMaterials::Reading {
  Material material;
  std::vector<std::size_t> sets;

  int Slot(std::size_t set, const Gltf& gltf) {
    const auto known = std::find(sets.begin(), sets.end(), set);
    if (known == sets.end() && sets.size() == 2)
      gltf.Fail(fmt::format(
          "material '{}' places its textures by TEXCOORD_{}, TEXCOORD_{} and TEXCOORD_{}; two sets "
          "at most are read",
          material.name, sets[0], sets[1], set));
    const auto slot = static_cast<int>(known - sets.begin());
    if (known == sets.end()) sets.push_back(set);
    return slot;
  }

  // Numbers of `key`, each in [0, 1].
  template <std::size_t N>
  std::array<float, N> Factors(const Json& source, const std::string& key,
                               const std::array<float, N>& fallback, const Gltf& gltf) const {
    if (!source.contains(key)) return fallback;
    const auto values = core::Field<std::vector<double>>(source, key, gltf.file());
    if (values.size() < N)
      gltf.Fail(fmt::format("the {} of material '{}' has {} numbers where {} belong", key,
                            material.name, values.size(), N));
    std::array<float, N> factors;
    for (std::size_t k = 0; k < N; ++k) factors[k] = Share(values[k], key, gltf);
    return factors;
  }
  float Factor(const Json& source, const std::string& key, double fallback,
               const Gltf& gltf) const {
    return Share(FieldOr<double>(source, key, fallback, gltf.file()), key, gltf);
  }
  float Share(double value, const std::string& key, const Gltf& gltf) const {
    if (!std::isfinite(value))
      gltf.Fail(fmt::format("the {} of material '{}' is not finite", key, material.name));
    return static_cast<float>(std::clamp(value, 0.0, 1.0));
  }
};

const GltfMaterial& GltfMaterials::Get(const std::optional<std::size_t>& index) {
  const auto [entry, is_new] = materials_.try_emplace(index);
  if (!is_new) return entry->second;
  Reading reading;
  Material material = Read(index ? gltf_.Element("materials", *index) : Json::object(), reading);
  for (std::size_t k = 0; k < reading.sets.size(); ++k) entry->second.sets[k] = reading.sets[k];
  entry->second.material = static_cast<std::uint32_t>(geometry_.materials.size());
  geometry_.materials.push_back(std::move(material));
  return entry->second;
}

Material GltfMaterials::Read(const Json& source, Reading& reading) {
  Material& material = reading.material;
  material.name = FieldOr<std::string>(source, "name", "", gltf_.file());
  if (const Json* specular = Extension(source, kSpecularGlossiness))
    ReadSpecularGlossiness(*specular, reading);
  else
    ReadMetallicRoughness(
        FieldOr<Json>(source, "pbrMetallicRoughness", Json::object(), gltf_.file()), reading);

  ReadTexture(source, "normalTexture", Alpha::kDropped, reading, material.normal_texture,
              material.normal_placement);
  if (material.normal_texture >= 0) {
    const auto scale = FieldOr<double>(source["normalTexture"], "scale", 1, gltf_.file());
    if (!std::isfinite(scale))
      gltf_.Fail(fmt::format("the normal scale of material '{}' is not finite", material.name));
    material.normal_scale = static_cast<float>(scale);
  }

  double strength = 1;
  if (const Json* extension = Extension(source, "KHR_materials_emissive_strength"))
    strength = FieldOr<double>(*extension, "emissiveStrength", 1, gltf_.file());
  if (!(strength >= 0 && strength <= kBrightest))
    gltf_.Fail(fmt::format("emissiveStrength = {} of material '{}' is outside [0, {:g}]", strength,
                           material.name, kBrightest));
  const auto emission = reading.Factors<3>(source, "emissiveFactor", {0, 0, 0}, gltf_);
  for (std::size_t c = 0; c < 3; ++c)
    material.emission[c] = static_cast<float>(strength * emission[c]);
  if (IsEmissive(material))
    ReadTexture(source, "emissiveTexture", Alpha::kDropped, reading, material.emission_texture,
                material.emission_placement);
  return material;
}

void GltfMaterials::ReadMetallicRoughness(const Json& source, Reading& reading) {
  Material& material = reading.material;
  material.kind = MaterialKind::kGgx;
  material.albedo = reading.Factors<3>(source, "baseColorFactor", {1, 1, 1}, gltf_);
  material.metallic = reading.Factor(source, "metallicFactor", 1, gltf_);
  material.roughness = reading.Factor(source, "roughnessFactor", 1, gltf_);
  ReadTexture(source, "baseColorTexture", Alpha::kDropped, reading, material.texture,
              material.texture_placement);
  ReadTexture(source, "metallicRoughnessTexture", Alpha::kDropped, reading,
              material.metallic_roughness_texture, material.gloss_placement);
}

void GltfMaterials::ReadSpecularGlossiness(const Json& source, Reading& reading) {
  Material& material = reading.material;
  material.kind = MaterialKind::kSpecularGlossiness;
  material.albedo = reading.Factors<3>(source, "diffuseFactor", {1, 1, 1}, gltf_);
  material.specular = reading.Factors<3>(source, "specularFactor", {1, 1, 1}, gltf_);
  material.glossiness = reading.Factor(source, "glossinessFactor", 1, gltf_);
  ReadTexture(source, "diffuseTexture", Alpha::kDropped, reading, material.texture,
              material.texture_placement);
  ReadTexture(source, "specularGlossinessTexture", Alpha::kKept, reading,
              material.specular_glossiness_texture, material.gloss_placement);
}

void GltfMaterials::ReadTexture(const Json& owner, const std::string& key, Alpha alpha,
                                Reading& reading, int& texture, TexturePlacement& placement) {
  if (!owner.contains(key)) return;
  const Json& use = owner[key];
  auto set = FieldOr<std::size_t>(use, "texCoord", 0, gltf_.file());
  if (const Json* transform = Extension(use, "KHR_texture_transform")) {
    Place(*transform, gltf_, placement);
    set = FieldOr<std::size_t>(*transform, "texCoord", set, gltf_.file());
  }
  placement.set = reading.Slot(set, gltf_);
  texture = TextureIndex(core::Field<std::size_t>(use, "index", gltf_.file()), alpha,
                         reading.material.name);
}

int GltfMaterials::TextureIndex(std::size_t texture, Alpha alpha, const std::string& material) {
  const Json& of = gltf_.Element("textures", texture);
  const Json* webp = Extension(of, "EXT_texture_webp");
  const Json& source = of.contains("source") || !webp ? of : *webp;
  if (!source.contains("source"))
    gltf_.Fail(fmt::format("a texture of material '{}' is neither PNG, JPEG nor WebP", material));
  const auto image = core::Field<std::size_t>(source, "source", gltf_.file());
  const auto [entry, is_new] =
      images_.try_emplace({image, alpha}, static_cast<int>(geometry_.textures.size()));
  if (is_new) geometry_.textures.push_back(gltf_.Image(image, alpha));
  return entry->second;
}

}  // namespace luxfield::scene
