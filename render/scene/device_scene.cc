#include "luxfield/render/scene/device_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/brdf/brdf_types.clh"
#include "luxfield/render/kernels/scene/bvh_types.clh"
#include "luxfield/render/kernels/scene/gbuffer_types.clh"

namespace luxfield::render {
namespace {

static_assert(scene::Bvh::kMaxDepth <= kBvhStackSize && scene::Bvh::kMaxLeafSize <= kBvhMaxLeaf);

int EncodeChild(const scene::Bvh::Child& child) {
  return child.node >= 0 ? child.node : ~((child.first << 4) | child.count);
}

void Store(scene::Vec3 v, float (&out)[3]) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

ShadedTriangle Shade(const scene::Geometry& geometry, const scene::Triangle& triangle) {
  ShadedTriangle shaded{};
  for (int k = 0; k < 3; ++k) {
    const auto& vertex = geometry.vertices[triangle.vertex[k]];
    std::copy(vertex.normal.begin(), vertex.normal.end(), shaded.corner[k].normal);
    std::copy(vertex.uv.begin(), vertex.uv.end(), shaded.corner[k].uv[0]);
    std::copy(vertex.uv1.begin(), vertex.uv1.end(), shaded.corner[k].uv[1]);
  }
  shaded.material = static_cast<int>(triangle.material);
  return shaded;
}

// The kind and the parameters beside the albedo, as a G-buffer holds them.
void SetGloss(const scene::Material& from, SurfaceMaterial& material) {
  switch (from.kind) {
    case scene::MaterialKind::kLambert:
      material.kind = kLambert;
      break;
    case scene::MaterialKind::kPhong:
      material.kind = kPhong;
      std::copy(from.specular.begin(), from.specular.end(), material.gloss);
      material.gloss[3] = from.exponent;
      break;
    case scene::MaterialKind::kGgx:
      material.kind = kGgx;
      material.gloss[0] = from.metallic;
      material.gloss[1] = from.roughness;
      break;
    case scene::MaterialKind::kSpecularGlossiness:
      material.kind = kSpecularGlossiness;
      std::copy(from.specular.begin(), from.specular.end(), material.gloss);
      material.gloss[3] = 1 - from.glossiness;
      break;
  }
}

}  // namespace

DeviceBvh UploadBvh(const Device& device, const scene::Geometry& geometry, const scene::Bvh& bvh) {
  std::vector<BvhNode> nodes;
  nodes.reserve(bvh.nodes.size());
  for (const auto& from : bvh.nodes) {
    const auto& [left, right] = from.children;
    BvhNode node{};
    std::copy(left.box.lower.begin(), left.box.lower.end(), node.lower0);
    std::copy(left.box.upper.begin(), left.box.upper.end(), node.upper0);
    std::copy(right.box.lower.begin(), right.box.lower.end(), node.lower1);
    std::copy(right.box.upper.begin(), right.box.upper.end(), node.upper1);
    node.child0 = EncodeChild(left);
    node.child1 = EncodeChild(right);
    nodes.push_back(node);
  }
  std::vector<BvhTriangle> triangles;
  triangles.reserve(bvh.order.size());
  for (const std::uint32_t index : bvh.order) {
    BvhTriangle triangle{};
    std::copy_n(geometry.corner(index, 0).begin(), 3, triangle.a);
    std::copy_n(geometry.corner(index, 1).begin(), 3, triangle.b);
    std::copy_n(geometry.corner(index, 2).begin(), 3, triangle.c);
    triangle.index = static_cast<int>(index);
    triangles.push_back(triangle);
  }
  return {Buffer::From(device, nodes), Buffer::From(device, triangles)};
}

DeviceScene UploadScene(const Device& device, const scene::Geometry& geometry) {
  std::vector<ShadedTriangle> shading;
  shading.reserve(geometry.triangles.size());
  for (const auto& triangle : geometry.triangles) shading.push_back(Shade(geometry, triangle));

  std::vector<std::uint32_t> texels;
  std::vector<int> offsets;
  for (const auto& texture : geometry.textures) {
    if (texels.size() + texture.rgba.size() >
        static_cast<std::size_t>(std::numeric_limits<int>::max()))
      throw InputError("the scene's textures hold more than 2^31 texels; use smaller ones");
    offsets.push_back(static_cast<int>(texels.size()));
    texels.insert(texels.end(), texture.rgba.begin(), texture.rgba.end());
  }
  const auto texels_of = [&](int texture, const scene::TexturePlacement& placement) {
    TextureTexels of{};
    of.offset = -1;
    if (texture < 0) return of;
    of = {offsets[texture],
          geometry.textures[texture].width,
          geometry.textures[texture].height,
          placement.set,
          {}};
    for (std::size_t row = 0; row < 2; ++row)
      std::copy_n(placement.rows[row].begin(), 3, of.placement + 3 * row);
    return of;
  };
  std::vector<SurfaceMaterial> materials;
  for (const auto& from : geometry.materials) {
    SurfaceMaterial material{};
    std::copy(from.albedo.begin(), from.albedo.end(), material.albedo);
    SetGloss(from, material);
    material.colour = texels_of(from.texture, from.texture_placement);
    material.gloss_values = texels_of(from.kind == scene::MaterialKind::kSpecularGlossiness
                                          ? from.specular_glossiness_texture
                                          : from.metallic_roughness_texture,
                                      from.gloss_placement);
    material.normal = texels_of(from.normal_texture, from.normal_placement);
    material.emission_colour = texels_of(from.emission_texture, from.emission_placement);
    material.normal_scale = from.normal_scale;
    std::copy(from.emission.begin(), from.emission.end(), material.emission);
    materials.push_back(material);
  }
  return {UploadBvh(device, geometry, scene::BuildBvh(geometry)),
          Buffer::From(device, shading),
          Buffer::From(device, materials),
          Buffer::From(device, texels),
          std::any_of(geometry.materials.begin(), geometry.materials.end(), scene::IsGlossy),
          std::any_of(geometry.materials.begin(), geometry.materials.end(), scene::IsEmissive)};
}

PinholeCamera MakePinhole(const scene::Camera& camera, int width, int first_row, int rows,
                          lightfield::Vec2 sample) {
  const auto corner = camera.Direction(0, 0);
  PinholeCamera pinhole{};
  Store(camera.position, pinhole.position);
  Store(corner, pinhole.corner);
  Store(camera.Direction(1, 0) - corner, pinhole.right);
  Store(camera.Direction(0, 1) - corner, pinhole.down);
  pinhole.sample_x = static_cast<float>(sample.x);
  pinhole.sample_y = static_cast<float>(sample.y);
  pinhole.width = width;
  pinhole.first_row = first_row;
  pinhole.rows = rows;
  return pinhole;
}

PrimaryVisibility::PrimaryVisibility(const Device& device)
    : kernel_(Program::Build(device, "kernels/scene/gbuffer.cl"), "PrimaryRays") {}

Event PrimaryVisibility::Render(const DeviceScene& scene, const scene::Camera& camera,
                                int first_row, lightfield::Vec2 sample, GBuffer& gbuffer,
                                WorkSize local) {
  const PinholeCamera pinhole =
      MakePinhole(camera, gbuffer.width, first_row, gbuffer.height, sample);
  kernel_.Set(pinhole, scene.bvh.nodes, scene.bvh.triangles, scene.shading, scene.materials,
              scene.texels, gbuffer.position, gbuffer.normal, gbuffer.albedo, gbuffer.gloss,
              gbuffer.emission);
  gbuffer.eye = {{pinhole.position[0], pinhole.position[1], pinhole.position[2], 1}};
  return kernel_.Enqueue(
      {static_cast<std::size_t>(gbuffer.width), static_cast<std::size_t>(gbuffer.height)}, local);
}

}  // namespace luxfield::render
