#include "luxfield/render/scene/device_scene.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/brdf/brdf_types.clh"
#include "luxfield/render/kernels/scene/gbuffer_types.clh"

namespace luxfield::render {
namespace {

constexpr int kRaysAtOnce = 1 << 17;  // primary rays: bounds the memory of rays and hits

void Store(scene::Vec3 v, float (&out)[3]) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

// The scene's own arrays are what the kernel reads.
static_assert(sizeof(scene::Vertex) == sizeof(SceneVertex) &&
              offsetof(scene::Vertex, normal) == offsetof(SceneVertex, normal) &&
              offsetof(scene::Vertex, uv) == offsetof(SceneVertex, uv));
static_assert(sizeof(scene::Triangle) == sizeof(SceneTriangle) &&
              offsetof(scene::Triangle, material) == offsetof(SceneTriangle, material));

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

// Where each texture begins, as their texels lie one after the other.
std::vector<int> OffsetsOf(const std::vector<scene::Texture>& textures) {
  std::size_t texels = 0;
  std::vector<int> offsets;
  for (const auto& texture : textures) {
    if (texels + texture.rgba.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      throw InputError("the scene's textures hold more than 2^31 texels; use smaller ones");
    offsets.push_back(static_cast<int>(texels));
    texels += texture.rgba.size();
  }
  return offsets;
}

std::vector<SurfaceMaterial> SurfaceMaterials(const std::vector<scene::Material>& materials,
                                              const std::vector<scene::Texture>& textures) {
  const std::vector<int> offsets = OffsetsOf(textures);
  const auto texels_of = [&](int texture, const scene::TexturePlacement& placement) {
    TextureTexels of{};
    of.offset = -1;
    if (texture < 0) return of;
    of = {offsets[texture], textures[texture].width, textures[texture].height, placement.set, {}};
    for (std::size_t row = 0; row < 2; ++row)
      std::copy_n(placement.rows[row].begin(), 3, of.placement + 3 * row);
    return of;
  };
  std::vector<SurfaceMaterial> surfaces;
  for (const auto& from : materials) {
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
    surfaces.push_back(material);
  }
  return surfaces;
}

// `own`: the geometry, where its vertices and triangles are to go; else null.
DeviceScene Upload(const Device& device, const scene::Geometry& geometry, scene::Geometry* own) {
  const std::vector<SurfaceMaterial> materials =
      SurfaceMaterials(geometry.materials, geometry.textures);
  std::vector<std::uint32_t> texels;
  for (const auto& texture : geometry.textures)
    texels.insert(texels.end(), texture.rgba.begin(), texture.rgba.end());
  DeviceScene uploaded{device, MakeRayScene(device, geometry), {}, {}, {}, {}};
  uploaded.vertices = Buffer::From(device, geometry.vertices);
  if (own) own->vertices = std::vector<scene::Vertex>();
  uploaded.triangles = Buffer::From(device, geometry.triangles);
  if (own) own->triangles = std::vector<scene::Triangle>();
  uploaded.materials = Buffer::From(device, materials);
  uploaded.texels = Buffer::From(device, texels);
  uploaded.glossy =
      std::any_of(geometry.materials.begin(), geometry.materials.end(), scene::IsGlossy);
  uploaded.emissive =
      std::any_of(geometry.materials.begin(), geometry.materials.end(), scene::IsEmissive);
  return uploaded;
}

}  // namespace

void ReplaceMaterials(const std::vector<scene::Material>& materials,
                      const std::vector<scene::Texture>& textures, DeviceScene& scene) {
  scene.materials = Buffer::From(scene.device, SurfaceMaterials(materials, textures));
}

DeviceScene UploadScene(const Device& device, const scene::Geometry& geometry) {
  return Upload(device, geometry, nullptr);
}

DeviceScene UploadScene(const Device& device, scene::Geometry&& geometry) {
  return Upload(device, geometry, &geometry);
}

const DeviceBvh& DeviceScene::bvh() const {
  if (const DeviceBvh* of_rays = rays->bvh()) return *of_rays;
  if (!own_bvh) {
    scene::Geometry geometry;
    geometry.vertices = vertices.Download<scene::Vertex>();
    geometry.triangles = triangles.Download<scene::Triangle>();
    own_bvh = std::make_shared<DeviceBvh>(UploadBvh(device, geometry, scene::BuildBvh(geometry)));
  }
  return *own_bvh;
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
    : device_(device),
      cast_(Program::Build(device, "kernels/scene/gbuffer.cl"), "CastPrimaryRays"),
      shade_(Program::Build(device, "kernels/scene/gbuffer.cl"), "ShadeHits") {}

Event PrimaryVisibility::Render(const DeviceScene& scene, const scene::Camera& camera,
                                int first_row, lightfield::Vec2 sample, GBuffer& gbuffer,
                                WorkSize local) {
  const int rows_at_once = std::clamp(kRaysAtOnce / gbuffer.width, 1, gbuffer.height);
  const std::size_t rays_at_once = static_cast<std::size_t>(rows_at_once) * gbuffer.width;
  const Buffer rays(device_, rays_at_once * sizeof(scene::PackedRay)),
      hits(device_, rays_at_once * sizeof(scene::PackedHit));
  std::optional<Event> last;
  for (int row = 0; row < gbuffer.height; row += rows_at_once) {
    const int rows = std::min(rows_at_once, gbuffer.height - row), count = rows * gbuffer.width;
    const PinholeCamera pinhole = MakePinhole(camera, gbuffer.width, first_row + row, rows, sample);
    gbuffer.eye = {{pinhole.position[0], pinhole.position[1], pinhole.position[2], 1}};
    cast_.Set(pinhole, rays)
        .Enqueue({static_cast<std::size_t>(gbuffer.width), static_cast<std::size_t>(rows)}, local);
    scene.rays->Intersect(
        {.rays = rays, .group_count = static_cast<std::size_t>(count), .coherent = true}, hits);
    last =
        shade_
            .Set(static_cast<cl_int>(row * gbuffer.width), static_cast<cl_int>(count), rays, hits,
                 scene.vertices, scene.triangles, scene.materials, scene.texels, gbuffer.position,
                 gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.emission)
            .Enqueue({static_cast<std::size_t>(count)}, {local.x * local.y});
  }
  return std::move(*last);
}

}  // namespace luxfield::render
