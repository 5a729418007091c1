// The G-buffer against closed forms and against textures sampled on the host.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/random.h"
#include "luxfield/render/kernels/brdf/brdf_types.clh"
#include "luxfield/render/scene/device_scene.h"
#include "luxfield/scene/texture.h"
#include "tests/render/triangle_soup.h"

namespace luxfield::render {
namespace {

using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using scene::Geometry;
using scene::Transform;
using scene::Vec3;

struct Pixels {
  std::vector<cl_float4> position, normal, albedo;
};

Pixels RenderPixels(const Geometry& geometry, const scene::Camera& camera, WorkSize local = {16, 4},
                    int first_row = 0, int rows = 0) {
  const auto device = Device::Open();
  GBuffer gbuffer(device, camera.width, rows ? rows : camera.height);
  PrimaryVisibility(device)
      .Render(UploadScene(device, geometry), camera, first_row, {0.5, 0.5}, gbuffer, local)
      .Wait();
  return {gbuffer.position.Download<cl_float4>(), gbuffer.normal.Download<cl_float4>(),
          gbuffer.albedo.Download<cl_float4>()};
}

Vec3 ToVec3(const cl_float4& v) { return {v.s[0], v.s[1], v.s[2]}; }

Geometry WithMaterial(Geometry geometry) {
  geometry.materials = {{"m", {0.25f, 0.5f, 0.75f}, -1}};
  return geometry;
}

TEST(GBufferTest, MatchesThePlaneInClosedForm) {
  Geometry geometry = WithMaterial({});
  scene::AppendQuad({-10, -10, 0.25}, {20, 0, 0}, {0, 20, 0}, 0, geometry);
  const auto camera = scene::Camera::LookAt({1, -2, 3}, {0, 0.5, 0}, {0, 0, 1}, 50, 31, 17);
  const auto pixels = RenderPixels(geometry, camera);
  int hits = 0;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * camera.width + column;
      const Vec3 direction = camera.Direction(column + 0.5, row + 0.5);
      const Vec3 expected =
          camera.position + ((0.25 - camera.position.z) / direction.z) * direction;
      const bool inside = direction.z < 0 && std::abs(expected.x) < 10 && std::abs(expected.y) < 10;
      ASSERT_EQ(pixels.position[i].s[3], inside ? 1.0f : 0.0f);
      if (!inside) continue;
      ++hits;
      EXPECT_NEAR(Length(ToVec3(pixels.position[i]) - expected), 0, 1e-5 * Length(direction) * 10);
      EXPECT_EQ(pixels.position[i].s[2], 0.25f);
      EXPECT_NEAR(Length(ToVec3(pixels.normal[i]) - Vec3{0, 0, 1}), 0, 1e-6);
      EXPECT_THAT(pixels.albedo[i].s, testing::ElementsAre(0.25f, 0.5f, 0.75f, 0.0f));
    }
  EXPECT_GT(hits, 300);
}

TEST(GBufferTest, NormalsFaceTheCameraFromBothSidesAndFromInside) {
  Geometry geometry = WithMaterial({});
  AppendBox(scene::Scaling({4, 2, 3}), 0, geometry);
  const auto camera = scene::Camera::LookAt({0.3, 0.2, 0.1}, {1, 0.4, 0.6}, {0, 0, 1}, 120, 24, 20);
  const auto pixels = RenderPixels(geometry, camera);
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * camera.width + column;
      ASSERT_EQ(pixels.position[i].s[3], 1.0f);
      const Vec3 p = ToVec3(pixels.position[i]);
      EXPECT_NEAR(std::max({std::abs(p.x) / 2, std::abs(p.y), std::abs(p.z) / 1.5}), 1, 1e-6);
      EXPECT_LT(Dot(ToVec3(pixels.normal[i]), camera.Direction(column + 0.5, row + 0.5)), 0);
      EXPECT_NEAR(Length(ToVec3(pixels.normal[i])), 1, 1e-6);
    }
}

// The mesh's normals are interpolated and transformed right under non-uniform scale: an ellipsoid.
TEST(GBufferTest, InterpolatesNormalsOfAnEllipsoid) {
  constexpr int kRings = 60;
  const Transform world_from_sphere =
      scene::RotationXyz({20, 30, 40}) * scene::Scaling({1, 2, 0.5});
  Geometry geometry = WithMaterial({});
  for (int i = 0; i <= kRings; ++i)
    for (int j = 0; j <= kRings; ++j) {
      const double theta = M_PI * i / kRings, phi = 2 * M_PI * j / kRings;
      const Vec3 n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                   std::cos(theta)};
      const Vec3 p = world_from_sphere.Point(n), m = world_from_sphere.Normal(n);
      geometry.vertices.push_back(
          {{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)},
           {static_cast<float>(m.x), static_cast<float>(m.y), static_cast<float>(m.z)},
           {}});
    }
  for (std::uint32_t i = 0; i < kRings; ++i)
    for (std::uint32_t j = 0; j < kRings; ++j) {
      const std::uint32_t first = i * (kRings + 1) + j;
      geometry.triangles.push_back({{first, first + kRings + 1, first + kRings + 2}, 0});
      geometry.triangles.push_back({{first, first + kRings + 2, first + 1}, 0});
    }
  const auto camera = scene::Camera::LookAt({5, 1, 2}, {0, 0, 0}, {0, 0, 1}, 30, 32, 32);
  const auto pixels = RenderPixels(geometry, camera);
  const Transform sphere_from_world = world_from_sphere.Inverse();
  int hits = 0;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column) {
      const std::size_t i = static_cast<std::size_t>(row) * 32 + column;
      // Ray against the unit sphere in the sphere's frame.
      const Vec3 o = sphere_from_world.Point(camera.position);
      const Vec3 d = sphere_from_world.Vector(camera.Direction(column + 0.5, row + 0.5));
      const double a = Dot(d, d), b = Dot(o, d), c = Dot(o, o) - 1, root = b * b - a * c;
      if (root < 0.09 * a) continue;  // near the silhouette the facets differ from the sphere
      const Vec3 n = o + ((-b - std::sqrt(root)) / a) * d;
      ASSERT_EQ(pixels.position[i].s[3], 1.0f);
      ++hits;
      // Facets of 6 degrees sag by 0.14 %; a normal interpolated over one is right to 0.5 degrees.
      EXPECT_NEAR(Length(ToVec3(pixels.position[i]) - world_from_sphere.Point(n)), 0, 0.03);
      EXPECT_GT(Dot(ToVec3(pixels.normal[i]), world_from_sphere.Normal(n)), std::cos(0.04));
    }
  EXPECT_GT(hits, 50);
}

TEST(GBufferTest, TexturesMatchTheHostsSampling) {
  Geometry geometry;
  scene::Texture texture{"t", 5, 3, {}};
  core::Random random(8, 0);
  for (int i = 0; i < 15; ++i) texture.rgba.push_back(random());
  geometry.textures = {{"other", 1, 1, {0}}, texture};
  geometry.materials = {{"m", {1, 0.5f, 1}, 1}};
  scene::AppendQuad({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 0, geometry);
  for (auto& vertex : geometry.vertices) {
    vertex.uv[0] = 2.5f * vertex.uv[0] - 1;  // repeats
    vertex.uv[1] = 1.5f * vertex.uv[1];
  }
  const auto camera = scene::Camera::LookAt({1, 0.5, 1}, {1, 0.5, 0}, {0, 1, 0}, 45, 40, 20);
  const auto pixels = RenderPixels(geometry, camera);
  int hits = 0;
  for (std::size_t i = 0; i < pixels.albedo.size(); ++i) {
    if (pixels.position[i].s[3] == 0) continue;
    ++hits;
    const std::array<float, 2> uv = {2.5f * pixels.position[i].s[0] / 2 - 1,
                                     1.5f * pixels.position[i].s[1]};
    const auto expected = scene::SampleTexture(texture, uv);
    EXPECT_NEAR(pixels.albedo[i].s[0], expected[0], 2e-5f);
    EXPECT_NEAR(pixels.albedo[i].s[1], 0.5f * expected[1], 2e-5f);
  }
  EXPECT_GT(hits, 300);
}

// Kinds, parameters and linear textures reach the G-buffer; Lambertian surfaces beside glossy ones
// stay Lambertian.
TEST(GBufferTest, HoldsTheBrdf) {
  Geometry geometry;
  geometry.textures = {{"metal, roughness", 1, 1, {0xFF00FF00u | (51u << 16)}}};
  scene::Material lambert{"l", {0.25f, 0.5f, 0.75f}}, phong = lambert, ggx = lambert;
  phong.kind = scene::MaterialKind::kPhong;
  phong.specular = {0.1f, 0.2f, 0.25f};
  phong.exponent = 77;
  ggx.kind = scene::MaterialKind::kGgx;
  ggx.metallic = 0.5f;
  ggx.roughness = 0.3f;
  ggx.metallic_roughness_texture = 0;
  geometry.materials = {lambert, phong, ggx};
  for (std::uint32_t m = 0; m < 3; ++m)
    scene::AppendQuad({1.0 * m, 0, 0}, {1, 0, 0}, {0, 1, 0}, m, geometry);
  const auto device = Device::Open();
  const auto uploaded = UploadScene(device, geometry);
  ASSERT_TRUE(uploaded.glossy);
  const auto camera = scene::Camera::LookAt({1.5, 0.5, 2}, {1.5, 0.5, 0}, {0, 1, 0}, 60, 30, 10);
  for (const bool glossy : {true, false}) {
    GBuffer gbuffer(device, camera.width, camera.height, glossy);
    PrimaryVisibility(device).Render(uploaded, camera, 0, {0.5, 0.5}, gbuffer).Wait();
    EXPECT_THAT(gbuffer.eye.s, testing::ElementsAre(1.5f, 0.5f, 2.0f, 1.0f));
    const auto position = gbuffer.position.Download<cl_float4>();
    const auto albedo = gbuffer.albedo.Download<cl_float4>();
    const auto gloss = glossy ? gbuffer.gloss.Download<cl_float4>() : std::vector<cl_float4>();
    int seen[3] = {0, 0, 0};
    for (std::size_t i = 0; i < position.size(); ++i) {
      if (position[i].s[3] == 0) {
        if (glossy) {
          EXPECT_THAT(gloss[i].s, testing::Each(0.0f));
        }
        continue;
      }
      const int m = static_cast<int>(position[i].s[0]);
      ++seen[m];
      EXPECT_EQ(albedo[i].s[2], 0.75f);
      const int kinds[3] = {kLambert, kPhong, kGgx};
      EXPECT_EQ(albedo[i].s[3], glossy ? kinds[m] : kLambert);
      if (!glossy) continue;
      const cl_float4 expected[3] = {
          {{0, 0, 0, 0}}, {{0.1f, 0.2f, 0.25f, 77}}, {{0.1f, 0.3f, 0, 0}}};
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(gloss[i].s[c], expected[m].s[c], 1e-6f);
    }
    for (const int count : seen) EXPECT_GT(count, 5);
  }
}

// Every texture is looked up with its own set of coordinates and its own placement.
TEST(GBufferTest, TexturesArePlaced) {
  Geometry geometry;
  core::Random random(9, 0);
  for (int t = 0; t < 3; ++t) {
    scene::Texture texture{"t", 4, 3, {}};
    for (int i = 0; i < 12; ++i) texture.rgba.push_back(random());
    geometry.textures.push_back(texture);
  }
  scene::Material material{"m", {1, 1, 1}, 0};
  material.kind = scene::MaterialKind::kSpecularGlossiness;
  material.specular = {0.75f, 0.5f, 0.25f};
  material.glossiness = 0.9f;
  material.specular_glossiness_texture = 1;
  material.emission = {100, 200, 300};
  material.emission_texture = 2;
  material.texture_placement = {1, {{{0.5f, -0.25f, 0.125f}, {0.75f, 2, -0.5f}}}};
  material.gloss_placement = {0, {{{2, 0, 0.25f}, {0, 3, 0}}}};
  material.emission_placement = {1, {{{0, 1, 0}, {1, 0, 0}}}};
  scene::Material dark{"dark", {0.5f, 0.5f, 0.5f}};
  geometry.materials = {material, dark};
  scene::AppendQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0, geometry);
  for (auto& vertex : geometry.vertices) vertex.uv1 = {1 - vertex.uv[1], 3 * vertex.uv[0]};
  scene::AppendQuad({1, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1, geometry);
  const auto device = Device::Open();
  const auto uploaded = UploadScene(device, geometry);
  ASSERT_TRUE(uploaded.emissive);
  const auto camera = scene::Camera::LookAt({1, 0.5, 1.5}, {1, 0.5, 0}, {0, 1, 0}, 60, 30, 14);
  GBuffer gbuffer(device, camera.width, camera.height, true, true);
  PrimaryVisibility(device).Render(uploaded, camera, 0, {0.5, 0.5}, gbuffer).Wait();
  const auto position = gbuffer.position.Download<cl_float4>();
  const auto albedo = gbuffer.albedo.Download<cl_float4>();
  const auto gloss = gbuffer.gloss.Download<cl_float4>();
  const auto emission = gbuffer.emission.Download<cl_float4>();
  int hits = 0, unlit = 0;
  for (std::size_t i = 0; i < position.size(); ++i) {
    const float x = position[i].s[0], y = position[i].s[1];
    if (position[i].s[3] == 0 || x > 1) {
      ++unlit;
      EXPECT_THAT(emission[i].s, testing::Each(0.0f));
      continue;
    }
    ++hits;
    const std::array<float, 2> uv1 = {1 - y, 3 * x};
    const auto colour = scene::SampleTexture(
        geometry.textures[0],
        {0.5f * uv1[0] - 0.25f * uv1[1] + 0.125f, 0.75f * uv1[0] + 2 * uv1[1] - 0.5f});
    const std::array<float, 2> at = {2 * x + 0.25f, 3 * y};
    const auto specular = scene::SampleTexture(geometry.textures[1], at);
    // Alpha in the place of red, linear.
    scene::Texture alpha = geometry.textures[1];
    for (auto& texel : alpha.rgba) texel >>= 24;
    const float glossy = 0.9f * scene::SampleTexture(alpha, at, scene::TexelEncoding::kLinear)[0];
    const auto light = scene::SampleTexture(geometry.textures[2], {uv1[1], uv1[0]});
    float brightest = 0;
    for (int c = 0; c < 3; ++c) {
      const float f0 = material.specular[c] * specular[c];
      EXPECT_NEAR(gloss[i].s[c], f0, 3e-5f);
      brightest = std::max(brightest, f0);
      EXPECT_NEAR(emission[i].s[c], material.emission[c] * light[c], 3e-5f * material.emission[c]);
    }
    EXPECT_NEAR(gloss[i].s[3], 1 - glossy, 3e-5f);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(albedo[i].s[c], (1 - brightest) * colour[c], 5e-5f);
    EXPECT_EQ(albedo[i].s[3], kSpecularGlossiness);
  }
  EXPECT_GT(hits, 60);
  EXPECT_GT(unlit, 60);
}

// A normal texture that is turned with its placement tilts along the turned axes.
TEST(GBufferTest, PlacedNormalTexturesTiltAlongTheirOwnAxes) {
  Geometry geometry;
  geometry.textures = {{"normals", 1, 1, {204u | (82u << 8) | (219u << 16)}}};
  scene::Material material{"m"};
  material.normal_texture = 0;
  // A quarter turn: the texture's u runs along the set's v, its v against the set's u.
  material.normal_placement = {1, {{{0, 1, 0}, {-1, 0, 0}}}};
  geometry.materials = {material};
  scene::AppendQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0, geometry);
  for (auto& vertex : geometry.vertices) {
    vertex.uv1 = vertex.uv;
    vertex.uv = {0, 0};
  }
  const auto camera = scene::Camera::LookAt({0.5, 0.5, 2}, {0.5, 0.5, 0}, {0, 1, 0}, 20, 8, 8);
  const double u = 2 * 204 / 255.0 - 1, v = 2 * 82 / 255.0 - 1, w = 2 * 219 / 255.0 - 1;
  const Vec3 expected = Normalized(Vec3{-v, u, w});
  for (const auto& normal : RenderPixels(geometry, camera).normal)
    EXPECT_NEAR(Length(ToVec3(normal) - expected), 0, 1e-5);
}

// A normal texture tilts along rising u and rising v, mirrored and swapped coordinates included.
TEST(GBufferTest, NormalTexturesTiltAlongTheTextureAxes) {
  const auto camera = scene::Camera::LookAt({0.5, 0.5, 2}, {0.5, 0.5, 0}, {0, 1, 0}, 20, 8, 8);
  for (const bool swap : {false, true})
    for (const float mirror : {1.0f, -1.0f}) {
      Geometry geometry;
      // (0.6, -0.36, 0.72) as (204, 82, 219) of 255, to 1/255.
      geometry.textures = {{"normals", 1, 1, {204u | (82u << 8) | (219u << 16)}}};
      scene::Material material{"m"};
      material.normal_texture = 0;
      geometry.materials = {material};
      scene::AppendQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0, geometry);
      for (auto& vertex : geometry.vertices) {
        vertex.uv[0] *= mirror;
        if (swap) std::swap(vertex.uv[0], vertex.uv[1]);
      }
      const auto pixels = RenderPixels(geometry, camera);
      const double u = 2 * 204 / 255.0 - 1, v = 2 * 82 / 255.0 - 1, w = 2 * 219 / 255.0 - 1;
      const Vec3 expected = Normalized(Vec3{(swap ? v : u) * mirror, swap ? u : v, w});
      for (const auto& normal : pixels.normal)
        EXPECT_NEAR(Length(ToVec3(normal) - expected), 0, 1e-5) << swap << mirror;
    }
}

TEST(GBufferTest, NormalsBeyondTheSilhouetteAreBentToTheEye) {
  Geometry geometry = WithMaterial({});
  scene::AppendQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0, geometry);
  for (auto& vertex : geometry.vertices) vertex.normal = {-0.995f, 0, 0.1f};
  const auto camera = scene::Camera::LookAt({3, 0.5, 0.5}, {0.5, 0.5, 0}, {0, 0, 1}, 20, 16, 8);
  const auto pixels = RenderPixels(geometry, camera);
  int hits = 0;
  for (std::size_t i = 0; i < pixels.normal.size(); ++i) {
    if (pixels.position[i].s[3] == 0) continue;
    ++hits;
    const Vec3 to_eye = Normalized(camera.position - ToVec3(pixels.position[i]));
    EXPECT_GE(Dot(ToVec3(pixels.normal[i]), to_eye), 0.999e-3);
    EXPECT_NEAR(Length(ToVec3(pixels.normal[i])), 1, 1e-6);
  }
  EXPECT_GT(hits, 5);
}

TEST(GBufferTest, DoesNotDependOnWorkGroupsOrBands) {
  Geometry geometry = WithMaterial(TriangleSoup(30, 9));
  const auto camera = scene::Camera::LookAt({9, 8, 7}, {0, 0, 0}, {0, 0, 1}, 60, 37, 23);
  const auto whole = RenderPixels(geometry, camera);
  const auto other = RenderPixels(geometry, camera, {1, 1});
  const auto band = RenderPixels(geometry, camera, {64, 1}, 10, 5);
  const auto same = [](const cl_float4& a, const cl_float4& b) {
    return std::equal(std::begin(a.s), std::end(a.s), std::begin(b.s));
  };
  for (std::size_t i = 0; i < whole.position.size(); ++i) {
    ASSERT_TRUE(same(whole.position[i], other.position[i]) &&
                same(whole.normal[i], other.normal[i]));
  }
  for (std::size_t i = 0; i < band.position.size(); ++i)
    ASSERT_TRUE(same(whole.position[i + 10 * 37], band.position[i]));
}

TEST(GBufferTest, AnEmptySceneIsAllZero) {
  const auto pixels =
      RenderPixels({}, scene::Camera::LookAt({0, 0, 1}, {0, 1, 1}, {0, 0, 1}, 40, 8, 8));
  for (std::size_t i = 0; i < pixels.position.size(); ++i) {
    EXPECT_THAT(pixels.position[i].s, testing::Each(0.0f));
    EXPECT_THAT(pixels.normal[i].s, testing::Each(0.0f));
    EXPECT_THAT(pixels.albedo[i].s, testing::Each(0.0f));
  }
}

}  // namespace
}  // namespace luxfield::render
