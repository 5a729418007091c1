#include "luxfield/scene/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/scene/texture.h"
#include "tests/test_data.h"

namespace luxfield::scene {
namespace {

std::filesystem::path Write(const std::string& name, const std::string& bytes) {
  const auto path = std::filesystem::path(testing::TempDir()) / ("luxfield_mesh_" + name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

Geometry Read(const std::filesystem::path& path, const Transform& transform = {}) {
  Geometry geometry;
  AppendMesh(path, transform, {}, geometry);
  return geometry;
}

// Every hostile file ends in an InputError that names the file.
void ExpectRefused(const std::filesystem::path& path) {
  EXPECT_THAT([&] { Read(path); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr(path.filename().string())))
      << path;
}

constexpr char kTriangleObj[] =
    "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";

std::string PlyWithVertex(const std::string& z) {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
         "float z\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 " +
         z + "\n1 0 0\n0 1 0\n3 0 1 2\n";
}

TEST(Mesh, ReadsObjWithNormalsUnderATransform) {
  const auto geometry = Read(Write("triangle.obj", kTriangleObj),
                             Translation({0, 0, 5}) * RotationXyz({90, 0, 0}) * Scaling({3, 1, 1}));
  ASSERT_EQ(geometry.triangles.size(), 1u);
  EXPECT_THAT(geometry.corner(0, 1),
              testing::Pointwise(testing::FloatNear(1e-6f), {3.0f, 0.0f, 5.0f}));
  EXPECT_THAT(geometry.corner(0, 2),
              testing::Pointwise(testing::FloatNear(1e-6f), {0.0f, 0.0f, 7.0f}));
  EXPECT_THAT(geometry.vertices[0].normal,
              testing::Pointwise(testing::FloatNear(1e-6f), {0.0f, -1.0f, 0.0f}));
}

TEST(Mesh, ReadsPly) {
  const auto geometry = Read(Write("good.ply", PlyWithVertex("0.5")));
  ASSERT_EQ(geometry.triangles.size(), 1u);
  EXPECT_FLOAT_EQ(geometry.corner(0, 0)[2], 0.5f);
}

// The first byte of the data is that of x of the first vertex. Some end a line or are blank, which
// the reader of a header may take for its own.
TEST(Mesh, ReadsBinaryPlyWhateverItsFirstByteIs) {
  for (const std::string end : {"\n", "\r\n"})
    for (const unsigned first : {0x0Au, 0x0Du, 0x20u, 0x09u, 0x0A0Au, 0x0A0Du, 0x0D0Au}) {
      const std::uint32_t bits = 0x3E800000u + first;  // 0.25 and a little
      std::string ply;
      for (const char* line :
           {"ply", "format binary_little_endian 1.0", "element vertex 3", "property float x",
            "property float y", "property float z", "element face 1",
            "property list uchar int vertex_indices", "end_header"})
        ply += line + end;
      const auto put = [&](std::uint32_t number) {
        for (int shift = 0; shift < 32; shift += 8) ply += static_cast<char>(number >> shift);
      };
      for (const std::uint32_t x : {bits, 0u, 0u, 0x3F800000u, 0u, 0u, 0u, 0x3F800000u, 0u}) put(x);
      ply += '\3';
      for (const std::uint32_t corner : {0u, 1u, 2u}) put(corner);
      SCOPED_TRACE(testing::Message() << std::hex << first << (end == "\n" ? ", LF" : ", CR LF"));
      const auto geometry = Read(Write("binary.ply", ply));
      ASSERT_EQ(geometry.triangles.size(), 1u);
      EXPECT_EQ(geometry.corner(0, 0)[0], std::bit_cast<float>(bits));
    }
}

TEST(Mesh, TriangulatesPolygonsAndTakesTheFilesColours) {
  Write("colours.mtl", "newmtl red\nKd 0.7 0.1 0.05\n");
  const auto geometry = Read(Write("quad.obj",
                                   "mtllib luxfield_mesh_colours.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv "
                                   "0 1 0\nusemtl red\nf 1 2 3 4\n"));
  ASSERT_EQ(geometry.triangles.size(), 2u);
  const auto& material = geometry.materials[geometry.triangles[0].material];
  EXPECT_EQ(material.name, "red");
  EXPECT_THAT(material.albedo, testing::ElementsAre(0.7f, 0.1f, 0.05f));
}

TEST(Mesh, AGivenMaterialReplacesTheFiles) {
  Geometry geometry;
  geometry.materials.push_back({"mine", {0.1f, 0.2f, 0.3f}, -1});
  AppendMesh(Write("override.obj", kTriangleObj), {}, 0u, geometry);
  EXPECT_EQ(geometry.materials.size(), 1u);
  EXPECT_EQ(geometry.triangles[0].material, 0u);
}

TEST(Mesh, GltfWithAnExternalTextureLoads) {
  const auto path = testdata::Folder() / "mesh/kenney/vehicle-motorcycle.glb";
  LUXFIELD_NEEDS_DATA(path);
  const auto geometry = Read(path);
  EXPECT_GT(geometry.triangles.size(), 100u);
  ASSERT_FALSE(geometry.textures.empty());
  EXPECT_GT(geometry.textures[0].width, 1);
  // The texture's own colours reach the surface: a palette of many, not one.
  float low = 1, high = 0;
  for (const auto& vertex : geometry.vertices) {
    const auto colour = SampleTexture(geometry.textures[0], vertex.uv);
    low = std::min(low, colour[1]);
    high = std::max(high, colour[1]);
  }
  EXPECT_GT(high - low, 0.1f);
}

// One textured triangle whose material is `material`, JSON. Texture 0 is one texel (10, 128, 51),
// texture 1 one texel (204, 128, 230).
std::string Gltf(const std::string& material) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],)"
         R"("buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,)"
         R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/"}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
         R"("min":[0,0,0],"max":[1,1,0]},)"
         R"({"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}],)"
         R"("textures":[{"source":0},{"source":1}],)"
         R"("images":[{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAA)"
         R"(DElEQVR42mPgajAGAAFVAL5E73ArAAAAAElFTkSuQmCC"},{"uri":"data:image/png;base64,iVBORw0K)"
         R"(GgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR42mM40/AMAAROAjPJncPXAAAAAElFTkSuQmCC"}],)"
         R"("materials":[)" +
         material + "]}";
}

TEST(Mesh, GltfMaterialsAreMetallicRoughness) {
  const auto geometry = Read(Write("ggx.gltf", Gltf(R"({"name":"steel",
      "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1],"metallicFactor":0.75,
      "roughnessFactor":0.5,"metallicRoughnessTexture":{"index":0}},
      "normalTexture":{"index":1,"scale":0.5}})")));
  const auto& material = geometry.materials[geometry.triangles[0].material];
  EXPECT_EQ(material.kind, MaterialKind::kGgx);
  EXPECT_THAT(material.albedo, testing::ElementsAre(0.5f, 0.25f, 1.0f));
  EXPECT_EQ(material.texture, -1);
  EXPECT_FLOAT_EQ(material.metallic, 0.75f);
  EXPECT_FLOAT_EQ(material.roughness, 0.5f);
  EXPECT_FLOAT_EQ(material.normal_scale, 0.5f);
  ASSERT_EQ(geometry.textures.size(), 2u);
  const auto& texture = geometry.textures[material.metallic_roughness_texture];
  const auto values = SampleTexture(texture, {0.3f, 0.6f}, TexelEncoding::kLinear);
  EXPECT_NEAR(values[1], 128 / 255.0f, 1e-6f);  // roughness
  EXPECT_NEAR(values[2], 51 / 255.0f, 1e-6f);   // metallic
  EXPECT_NEAR(
      SampleTexture(geometry.textures[material.normal_texture], {0, 0}, TexelEncoding::kLinear)[0],
      0.8f, 1e-6f);

  // glTF's defaults: white metal, rough.
  const auto plain = Read(Write("default.gltf", Gltf("{}")));
  const auto& white = plain.materials[plain.triangles[0].material];
  EXPECT_EQ(white.kind, MaterialKind::kGgx);
  EXPECT_THAT(white.albedo, testing::Each(1.0f));
  EXPECT_EQ(white.metallic, 1);
  EXPECT_EQ(white.roughness, 1);
}

TEST(Mesh, ThirdPartyGltfIsMetallicRoughnessAndObjLambertian) {
  const auto folder = testdata::Folder() / "mesh";
  LUXFIELD_NEEDS_DATA(folder);
  for (const char* name : {"vehicle-motorcycle.glb", "vehicle-truck-red.glb"}) {
    const auto geometry = Read(folder / "kenney" / name);
    const auto& material = geometry.materials[geometry.triangles[0].material];
    EXPECT_EQ(material.kind, MaterialKind::kGgx) << name;
    EXPECT_EQ(material.metallic, 0) << name;
    EXPECT_EQ(material.roughness, 1) << name;
    EXPECT_GE(material.texture, 0) << name;
  }
  const auto spot = Read(folder / "spot.obj");
  EXPECT_EQ(spot.materials[spot.triangles[0].material].kind, MaterialKind::kLambert);
}

TEST(Mesh, SpotLoads) {
  const auto path = testdata::Folder() / "mesh/spot.obj";
  LUXFIELD_NEEDS_DATA(path);
  EXPECT_EQ(Read(path).triangles.size(), 5856u);  // 2928 quads
}

TEST(HostileMesh, MissingWrongTypeFolderAndEmptyAreRefused) {
  ExpectRefused(std::filesystem::path(testing::TempDir()) / "luxfield_mesh_missing.obj");
  ExpectRefused(Write("scene.blend", "BLENDER"));
  ExpectRefused(Write("empty.obj", ""));
  ExpectRefused(Write("empty.ply", ""));
  ExpectRefused(Write("empty.glb", ""));
  ExpectRefused(Write("text.glb", "this is no glTF file, only some words that pretend"));
  const auto folder = std::filesystem::path(testing::TempDir()) / "luxfield_mesh_folder.obj";
  std::filesystem::create_directories(folder);
  ExpectRefused(folder);
}

TEST(HostileMesh, WithoutTrianglesIsRefused) {
  ExpectRefused(Write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"));
  ExpectRefused(Write("line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"));
}

TEST(HostileMesh, NonFiniteVerticesAreRefused) {
  for (const char* bad : {"nan", "inf", "-inf", "1e60", "1e30", "-2e6"})
    ExpectRefused(Write(std::string(bad) + ".ply", PlyWithVertex(bad)));
}

TEST(HostileMesh, VertexNumbersOutOfRangeAreRefused) {
  ExpectRefused(Write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n"));
  std::string ply = PlyWithVertex("0");
  ply.replace(ply.rfind("3 0 1 2"), 7, "3 0 1 7");
  ExpectRefused(Write("range.ply", ply));
}

TEST(HostileMesh, TruncatedFilesAreRefused) {
  const std::string ply = PlyWithVertex("0");
  ExpectRefused(Write("truncated.ply", ply.substr(0, ply.size() - 20)));
  const auto path = testdata::Folder() / "mesh/kenney/vehicle-motorcycle.glb";
  LUXFIELD_NEEDS_DATA(path);
  const std::string glb = core::ReadFile(path);
  for (const double share : {0.001, 0.02, 0.3, 0.7, 0.999})
    ExpectRefused(
        Write("truncated.glb",
              glb.substr(0, static_cast<std::size_t>(share * static_cast<double>(glb.size())))));
}

TEST(HostileMesh, AMissingTextureIsNamed) {
  Write("texture.mtl", "newmtl m\nmap_Kd nowhere.png\n");
  const auto path = Write("texture.obj",
                          "mtllib luxfield_mesh_texture.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 "
                          "0\nusemtl m\nf 1/1 2/1 3/1\n");
  EXPECT_THAT([&] { Read(path); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("nowhere.png")));
}

TEST(Texture, RefusesWhatIsNoImage) {
  const auto noise = Write("noise.png", "\x89PNG but not really");
  EXPECT_THAT([&] { ReadTexture(noise); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("not an image")));
  EXPECT_THROW(DecodeTexture({}, "empty"), InputError);
}

TEST(Texture, MayHaveOneRow) {
  const auto two_texels = Write("row.ppm", "P6\n2 1\n255\n\x10\x20\x30\x40\x50\x60");
  const Texture texture = ReadTexture(two_texels);
  EXPECT_EQ(texture.width, 2);
  EXPECT_EQ(texture.height, 1);
  EXPECT_THAT(texture.rgba, testing::ElementsAre(0xFF302010u, 0xFF605040u));
}

TEST(Texture, LinearTexelsAreNotDecoded) {
  const Texture texture{"one", 1, 1, {0xFF336699u}};
  EXPECT_NEAR(SampleTexture(texture, {0, 0}, TexelEncoding::kLinear)[0], 0x99 / 255.0f, 1e-6f);
  EXPECT_LT(SampleTexture(texture, {0, 0})[0], 0.4f);
}

TEST(Texture, InterpolatesLinearLightAndRepeats) {
  // 2 x 1 texels: black, and sRGB 188 = linear 0.5029.
  const Texture texture{"two", 2, 1, {0xFF000000u, 0xFFBCBCBCu}};
  const float half = SampleTexture(texture, {0.75f, 0.5f})[0];
  EXPECT_NEAR(half, 0.5029f, 2e-4f);
  EXPECT_FLOAT_EQ(SampleTexture(texture, {0.25f, 0.5f})[0], 0.0f);
  EXPECT_NEAR(SampleTexture(texture, {0.5f, 0.5f})[0], half / 2, 1e-6f);
  EXPECT_NEAR(SampleTexture(texture, {0.0f, 0.5f})[0], half / 2,
              1e-6f);  // half a texel beyond the edge
  EXPECT_NEAR(SampleTexture(texture, {-1.25f, 7.5f})[0], half, 1e-6f);
}

// Files that crash assimp, keep it busy for good, or take all memory.
TEST(Mesh, HostileFilesAreRefused) {
  ExpectRefused(Write("endless.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"));
  std::string polygon = "v 0 0 0\n";
  for (int i = 0; i < 10001; ++i) polygon += "v " + std::to_string(i % 100) + " 1 0\n";
  polygon += "f";
  for (int i = 1; i <= 10001; ++i) polygon += " " + std::to_string(i);
  EXPECT_THAT([&] { Read(Write("polygon.obj", polygon + "\n")); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("has 10001 corners")));
  ExpectRefused(Write("nested.gltf", std::string(200000, '[')));
  std::string chain = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[)";
  for (int i = 1; i < 60000; ++i) chain += R"({"children":[)" + std::to_string(i) + "]},";
  ExpectRefused(Write("chain.gltf", chain + "{}]}"));
}

// A library file that is a pipe would keep assimp waiting for its other end.
TEST(Mesh, WhatAMeshRefersToIsARegularFile) {
  const auto pipe = std::filesystem::path(testing::TempDir()) / "luxfield_mesh_pipe.mtl";
  std::filesystem::remove(pipe);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(Read(Write("piped.obj",
                       "mtllib luxfield_mesh_pipe.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\n"
                       "f 1 2 3\n"))
                .triangles.size(),
            1u);
  std::filesystem::remove(pipe);
}

}  // namespace
}  // namespace luxfield::scene
