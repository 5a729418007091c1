#include "luxfield/scene/geometry_hash.h"

#include <vector>

#include "luxfield/core/bytes.h"
#include "luxfield/core/file.h"

namespace luxfield::scene {
namespace {

// Of elements without padding.
template <typename Element>
std::string Sha256OfAll(const std::vector<Element>& elements) {
  return core::Sha256(
      {reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(Element)});
}

}  // namespace

std::string Sha256Of(const Geometry& geometry) {
  static_assert(sizeof(Vertex) == 10 * sizeof(float) &&
                sizeof(Triangle) == 4 * sizeof(std::uint32_t));
  core::ByteWriter all;
  all(Sha256OfAll(geometry.vertices), Sha256OfAll(geometry.triangles));
  for (const Material& m : geometry.materials)
    all(m.albedo, m.texture, m.kind, m.specular, m.exponent, m.metallic, m.roughness, m.glossiness,
        m.metallic_roughness_texture, m.specular_glossiness_texture, m.normal_texture,
        m.normal_scale, m.emission, m.emission_texture, m.texture_placement, m.gloss_placement,
        m.normal_placement, m.emission_placement);
  for (const Texture& texture : geometry.textures)
    all(texture.width, texture.height, Sha256OfAll(texture.rgba));
  return core::Sha256(all.bytes());
}

}  // namespace luxfield::scene
