// glTF 2.0 files: instances, texture placements, materials, what is left out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/scene/mesh.h"
#include "luxfield/scene/texture.h"
#include "tests/test_data.h"

namespace luxfield::scene {
namespace {

using core::Json;
using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path Folder() {
  const auto folder = std::filesystem::path(testing::TempDir()) / "luxfield_gltf";
  std::filesystem::create_directories(folder);
  return folder;
}

std::filesystem::path Write(const std::string& name, const std::string& bytes) {
  std::ofstream(Folder() / name, std::ios::binary) << bytes;
  return Folder() / name;
}

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

// A file of one node with one mesh, whose buffers are added as they are asked for.
struct Builder {
  Json json = Json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{}}]}],
    "bufferViews":[],"accessors":[]})");
  std::string buffer;

  int Add(const std::string& bytes, int component_type, int count, const std::string& type,
          bool normalised = false) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}});
    buffer += bytes;
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", component_type},
                                 {"count", count},
                                 {"type", type},
                                 {"normalized", normalised}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }
  // The triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) with u = x, v = 1 - y in glTF's sense: our uv is
  // (x, y).
  Builder& Triangle() {
    Json& attributes = json["meshes"][0]["primitives"][0]["attributes"];
    const int positions = Add(Bytes<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}), 5126, 3, "VEC3");
    json["accessors"][positions]["min"] = {0, 0, 0};
    json["accessors"][positions]["max"] = {1, 1, 0};
    attributes["POSITION"] = positions;
    attributes["TEXCOORD_0"] = Add(Bytes<float>({0, 1, 1, 1, 0, 0}), 5126, 3, "VEC2");
    return *this;
  }
  Builder& Material(const Json& material) {
    json["materials"].push_back(material);
    json["meshes"][0]["primitives"][0]["material"] = json["materials"].size() - 1;
    return *this;
  }
  // Of one texel each: (10, 128, 51) and (204, 128, 230).
  Builder& Textures() {
    json["textures"] = Json::parse(R"([{"source":0},{"source":1}])");
    const std::string png =
        "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1Pe"
        "AAAADElEQVR42m";
    json["images"] = {{{"uri", png + "PgajAGAAFVAL5E73ArAAAAAElFTkSuQmCC"}},
                      {{"uri", png + "M40/AMAAROAjPJncPXAAAAAElFTkSuQmCC"}}};
    return *this;
  }
  std::string Text() const {
    Json whole = json;
    whole["buffers"] = {{{"byteLength", buffer.size()}, {"uri", "gltf_test.bin"}}};
    return whole.dump();
  }
  std::filesystem::path Save() const {
    Write("gltf_test.bin", buffer);
    return Write("gltf_test.gltf", Text());
  }
  // As a binary file (glTF 2.0, 4.4).
  std::filesystem::path SaveGlb() const {
    Json whole = json;
    whole["buffers"] = {{{"byteLength", buffer.size()}}};
    std::string text = whole.dump(), bin = buffer;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    bin.resize((bin.size() + 3) / 4 * 4);
    const auto word = [](std::size_t value) {
      return Bytes<std::uint32_t>({static_cast<std::uint32_t>(value)});
    };
    return Write("gltf_test.glb", "glTF" + word(2) + word(12 + 8 + text.size() + 8 + bin.size()) +
                                      word(text.size()) + "JSON" + text + word(bin.size()) +
                                      std::string("BIN\0", 4) + bin);
  }
};

Geometry Read(const std::filesystem::path& path, const Transform& transform = {}) {
  Geometry geometry;
  AppendMesh(path, transform, {}, geometry);
  return geometry;
}

const Material& MaterialOf(const Geometry& geometry) {
  return geometry.materials[geometry.triangles[0].material];
}

void ExpectRefused(const Builder& builder, const std::string& part) {
  const auto path = builder.Save();
  EXPECT_THAT([&] { Read(path); }, testing::ThrowsMessage<InputError>(testing::AllOf(
                                       HasSubstr("gltf_test.gltf"), HasSubstr(part))));
}

// v turned by the unit quaternion q = (x, y, z, w): q v q* written out with the cross product.
Vec3 Turned(const std::array<double, 4>& q, Vec3 v) {
  const Vec3 axis{q[0], q[1], q[2]};
  const Vec3 t = 2.0 * Cross(axis, v);
  return v + q[3] * t + Cross(axis, t);
}

// Every instance stands where T R S of its own, then the node's and its parents' transforms put it.
TEST(Gltf, PlacesInstances) {
  constexpr std::uint64_t kSeed = 31;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  core::Random random(kSeed, 0);
  constexpr int kInstances = 50;
  std::vector<float> translations, rotations, scales;
  for (int i = 0; i < kInstances; ++i) {
    for (int k = 0; k < 3; ++k) {
      translations.push_back(static_cast<float>(5 * random.Normal()));
      scales.push_back(static_cast<float>(0.5 + random.Uniform()));
    }
    std::array<double, 4> q;
    for (double& x : q) x = random.Normal();
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (const double x : q) rotations.push_back(static_cast<float>(x / length));
  }
  Builder builder;
  builder.Triangle();
  // Out of the plane z = 0, or the third axis of a rotation would not matter.
  constexpr double kZ[3] = {3, -2, 1};
  const int positions = builder.Add(Bytes<float>({0, 0, 3, 1, 0, -2, 0, 1, 1}), 5126, 3, "VEC3");
  builder.json["accessors"][positions]["min"] = {0, 0, -2};
  builder.json["accessors"][positions]["max"] = {1, 1, 3};
  builder.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions;
  // The instanced node is a child; its own child with the same mesh is there once.
  builder.json["nodes"] = Json::parse(
      R"([{"children":[1],"translation":[1,2,3]},{"mesh":0,"children":[2],"scale":[2,2,2]},
          {"mesh":0,"translation":[100,0,0]}])");
  builder.json["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", builder.Add(Bytes(translations), 5126, kInstances, "VEC3")},
      {"ROTATION", builder.Add(Bytes(rotations), 5126, kInstances, "VEC4")},
      {"SCALE", builder.Add(Bytes(scales), 5126, kInstances, "VEC3")}};
  for (const auto& path : {builder.Save(), builder.SaveGlb()}) {
    const Geometry geometry = Read(path);
    ASSERT_EQ(geometry.triangles.size(), kInstances + 1u);
    for (std::size_t i = 0; i < kInstances; ++i)
      for (int corner = 0; corner < 3; ++corner) {
        const Vec3 local{corner == 1 ? 1.0 * scales[3 * i] : 0,
                         corner == 2 ? 1.0 * scales[3 * i + 1] : 0, kZ[corner] * scales[3 * i + 2]};
        const std::array<double, 4> q{rotations[4 * i], rotations[4 * i + 1], rotations[4 * i + 2],
                                      rotations[4 * i + 3]};
        const Vec3 expected =
            Vec3{1, 2, 3} +
            2.0 * (Turned(q, local) +
                   Vec3{translations[3 * i], translations[3 * i + 1], translations[3 * i + 2]});
        const auto& found = geometry.corner(i, corner);
        // float32: coordinates below 64 m, rounded quaternions.
        EXPECT_NEAR(found[0], expected.x, 1e-5);
        EXPECT_NEAR(found[1], expected.y, 1e-5);
        EXPECT_NEAR(found[2], expected.z, 1e-5);
      }
    EXPECT_THAT(geometry.corner(kInstances, 0), ElementsAre(201, 2, 9));
  }
}

// Rotations may be 16-bit integers; each attribute may be absent.
TEST(Gltf, InstancesMayBeTurnedByIntegers) {
  Builder builder;
  builder.Triangle();
  const auto half = static_cast<std::int16_t>(std::lround(32767 * std::sqrt(0.5)));
  builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["ROTATION"] =
      builder.Add(Bytes<std::int16_t>({0, 0, half, half, 0, 0, 0, 32767}), 5122, 2, "VEC4", true);
  const Geometry geometry = Read(builder.Save());
  ASSERT_EQ(geometry.triangles.size(), 2u);
  EXPECT_NEAR(geometry.corner(0, 1)[0], 0, 1e-6);  // x to y: a quarter turn about z
  EXPECT_NEAR(geometry.corner(0, 1)[1], 1, 1e-6);
  EXPECT_THAT(geometry.corner(1, 1), ElementsAre(1, 0, 0));
}

TEST(Gltf, WrongInstancesAreNamed) {
  Builder builder;
  builder.Triangle();
  Json& attributes =
      builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  const int three = builder.Add(Bytes<float>({1, 2, 3, 4, 5, 6, 7, 8, 9}), 5126, 3, "VEC3");
  const int two = builder.Add(Bytes<float>({1, 2, 3, 4, 5, 6}), 5126, 2, "VEC3");
  const float nan = std::nanf("");
  const int unreal = builder.Add(Bytes<float>({nan, 2, 3}), 5126, 1, "VEC3");
  const int nowhere = builder.Add(Bytes<float>({1, 0, 0, 0, 0, 0, 0, 0}), 5126, 2, "VEC4");
  attributes = {{"TRANSLATION", three}, {"SCALE", two}};
  ExpectRefused(builder, "2 values of SCALE where others have 3");
  attributes = {{"TRANSLATION", unreal}};
  ExpectRefused(builder, "not finite");
  attributes = {{"ROTATION", nowhere}};
  ExpectRefused(builder, "instance 1 is rotated by a quaternion of zeros");
  attributes = {{"ROTATION", three}};
  ExpectRefused(builder, "accessors[2] is VEC3");
  attributes = {{"TRANSLATION", 77}};
  ExpectRefused(builder, "accessors[77]");
  attributes = {{"TRANSLATION", three}};
  builder.json["accessors"][three]["count"] = 4;
  ExpectRefused(builder, "ends beyond");
  builder.json["accessors"][three]["count"] = 4000000000u;
  ExpectRefused(builder, "ends beyond");
}

// glTF's own example (KHR_texture_transform): the lower left quadrant of the picture, turned
// clockwise by 90 degrees. And that the parts act in the order scale, rotation, offset.
TEST(Gltf, PlacesTextures) {
  const auto placed = [](const Json& transform, std::array<float, 2> uv) {
    Builder builder;
    builder.Triangle().Textures().Material(
        {{"pbrMetallicRoughness",
          {{"baseColorTexture",
            {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}}}}});
    const auto geometry = Read(builder.Save());
    const auto& rows = MaterialOf(geometry).texture_placement.rows;
    return std::array<float, 2>{rows[0][0] * uv[0] + rows[0][1] * uv[1] + rows[0][2],
                                rows[1][0] * uv[0] + rows[1][1] * uv[1] + rows[1][2]};
  };
  using testing::FloatNear;
  using testing::Pointwise;
  const Json quadrant = {{"offset", {0, 1}}, {"rotation", M_PI / 2}, {"scale", {0.5, 0.5}}};
  // The surface's upper left corner shows the quadrant's lower left one, and so on clockwise.
  EXPECT_THAT(placed(quadrant, {0, 1}), Pointwise(FloatNear(1e-6f), {0.0f, 0.0f}));
  EXPECT_THAT(placed(quadrant, {1, 1}), Pointwise(FloatNear(1e-6f), {0.0f, 0.5f}));
  EXPECT_THAT(placed(quadrant, {1, 0}), Pointwise(FloatNear(1e-6f), {0.5f, 0.5f}));
  EXPECT_THAT(placed(quadrant, {0, 0}), Pointwise(FloatNear(1e-6f), {0.5f, 0.0f}));
  // Its second example: v upside down.
  const Json flipped = {{"offset", {0, 1}}, {"scale", {1, -1}}};
  EXPECT_THAT(placed(flipped, {0.25f, 0.75f}), Pointwise(FloatNear(1e-6f), {0.25f, 0.25f}));
  // Scale first: u = 1 (downwards v = 1 in glTF's sense, our v = 0) becomes 3 along u, then points
  // up by a quarter turn counter-clockwise, from the upper left corner.
  const Json order = {{"rotation", M_PI / 2}, {"scale", {3, 1}}};
  EXPECT_THAT(placed(order, {1, 1}), Pointwise(FloatNear(1e-6f), {0.0f, 4.0f}));
}

TEST(Gltf, ReadsTwoSetsOfTextureCoordinates) {
  Builder builder;
  builder.Triangle().Textures();
  Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["TEXCOORD_1"] = builder.Add(Bytes<float>({9, 9, 9, 9, 9, 9}), 5126, 3, "VEC2");
  attributes["TEXCOORD_2"] =
      builder.Add(Bytes<float>({0.5f, 1, 0.25f, 1, 0, 0.25f}), 5126, 3, "VEC2");
  builder.Material(Json::parse(
      R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":2},
          "metallicRoughnessTexture":{"index":1,"texCoord":1,
          "extensions":{"KHR_texture_transform":{"texCoord":0}}}},
          "normalTexture":{"index":1,"texCoord":2}})"));
  const Geometry geometry = Read(builder.Save());
  const Material& material = MaterialOf(geometry);
  EXPECT_EQ(material.texture_placement.set, 0);
  EXPECT_EQ(material.gloss_placement.set, 1);  // the extension's set is the one that counts
  EXPECT_EQ(material.normal_placement.set, 0);
  EXPECT_THAT(geometry.vertices[1].uv, ElementsAre(0.25f, 0.0f));
  EXPECT_THAT(geometry.vertices[1].uv1, ElementsAre(1.0f, 0.0f));
  EXPECT_THAT(geometry.vertices[2].uv1, ElementsAre(0.0f, 1.0f));

  builder.json["materials"][0]["normalTexture"]["texCoord"] = 1;
  ExpectRefused(builder, "TEXCOORD_2, TEXCOORD_0 and TEXCOORD_1");
}

TEST(Gltf, ReadsSpecularAndGlossiness) {
  Builder builder;
  builder.Triangle().Textures().Material(Json::parse(R"({"name":"gold",
      "pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]},
      "extensions":{"KHR_materials_pbrSpecularGlossiness":{
        "diffuseFactor":[0.25,0.5,0.75,1],"specularFactor":[1,0.766,0.336],"glossinessFactor":0.9,
        "diffuseTexture":{"index":1},
        "specularGlossinessTexture":{"index":0}}}})"));
  const Geometry geometry = Read(builder.Save());
  const Material& material = MaterialOf(geometry);
  EXPECT_EQ(material.kind, MaterialKind::kSpecularGlossiness);
  EXPECT_THAT(material.albedo, ElementsAre(0.25f, 0.5f, 0.75f));
  EXPECT_THAT(material.specular, ElementsAre(1.0f, 0.766f, 0.336f));
  EXPECT_FLOAT_EQ(material.glossiness, 0.9f);
  ASSERT_GE(material.specular_glossiness_texture, 0);
  EXPECT_NE(material.texture, material.specular_glossiness_texture);
  // A picture without alpha is all gloss.
  EXPECT_EQ(geometry.textures[material.specular_glossiness_texture].rgba[0], 0xFF33800Au);
  EXPECT_EQ(geometry.textures[material.texture].rgba[0], 0xFFE680CCu);

  Builder plain;
  plain.Triangle().Material(
      Json::parse(R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{}}})"));
  const Geometry defaults = Read(plain.Save());
  EXPECT_THAT(MaterialOf(defaults).albedo, testing::Each(1.0f));
  EXPECT_THAT(MaterialOf(defaults).specular, testing::Each(1.0f));
  EXPECT_EQ(MaterialOf(defaults).glossiness, 1);
}

TEST(Gltf, KeepsTheGlossinessInAlpha) {
  Builder builder;
  builder.Triangle().Textures().Material(Json::parse(
      R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseTexture":{"index":0},
          "specularGlossinessTexture":{"index":0}}}})"));
  // One texel (10, 20, 30, 40), for both.
  builder.json["images"][0]["uri"] =
      "data:image/"
      "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mPgEpHTAAAAzQBl"
      "tceWUgAAAABJRU5ErkJggg==";
  const Geometry geometry = Read(builder.Save());
  EXPECT_EQ(geometry.textures[MaterialOf(geometry).specular_glossiness_texture].rgba[0],
            0x281E140Au);
  EXPECT_EQ(geometry.textures[MaterialOf(geometry).texture].rgba[0], 0xFF1E140Au);
}

// Texture coordinates may be normalised integers (glTF 2.0, 3.7.2.1).
TEST(Gltf, ReadsTextureCoordinatesOfIntegers) {
  Builder builder;
  builder.Triangle();
  Json& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["TEXCOORD_0"] =
      builder.Add(Bytes<std::uint16_t>({0, 65535, 65535, 65535, 13107, 0}), 5123, 3, "VEC2", true);
  const Geometry geometry = Read(builder.Save());
  EXPECT_THAT(geometry.vertices[1].uv, ElementsAre(1.0f, 0.0f));
  EXPECT_THAT(geometry.vertices[2].uv, ElementsAre(0.2f, 1.0f));
}

TEST(Gltf, ReadsEmission) {
  Builder builder;
  builder.Triangle().Textures().Material(Json::parse(R"({"emissiveFactor":[1,0.5,0.25],
      "emissiveTexture":{"index":1,"extensions":{"KHR_texture_transform":{"offset":[0.5,0]}}},
      "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":800}}})"));
  const Geometry geometry = Read(builder.Save());
  EXPECT_THAT(MaterialOf(geometry).emission, ElementsAre(800.0f, 400.0f, 200.0f));
  ASSERT_GE(MaterialOf(geometry).emission_texture, 0);
  EXPECT_FLOAT_EQ(MaterialOf(geometry).emission_placement.rows[0][2], 0.5f);
  EXPECT_TRUE(IsEmissive(MaterialOf(geometry)));
  // A factor of zero, the default, leaves a texture dark: it is not read.
  builder.json["materials"][0].erase("emissiveFactor");
  EXPECT_FALSE(IsEmissive(MaterialOf(Read(builder.Save()))));
  EXPECT_EQ(Read(builder.Save()).textures.size(), 0u);

  builder.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = {
      {"emissiveStrength", -1}};
  ExpectRefused(builder, "emissiveStrength = -1");
}

TEST(Gltf, NamesWhatItLeavesOut) {
  Builder builder;
  builder.Triangle().Textures().Material(
      Json::parse(R"({"alphaMode":"BLEND","emissiveFactor":[1,1,1],"occlusionTexture":{"index":0},
                      "extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1}}})"));
  builder.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_clearcoat",
                                    "KHR_texture_transform"};
  builder.json["extensions"]["KHR_lights_punctual"]["lights"] =
      Json::parse(R"([{"type":"point"},{"type":"spot","spot":{}}])");
  builder.json["samplers"] = Json::parse(R"([{"wrapS":33071},{"wrapS":10497},{}])");
  builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      builder.Add(Bytes<float>({1, 1, 1, 1, 1, 1, 1, 1, 1}), 5126, 3, "VEC3");
  const auto path = builder.Save();
  Geometry geometry;
  EXPECT_THAT(AppendMesh(path, {}, {}, geometry),
              ElementsAre("the light (KHR_lights_punctual) of 2 lamps",
                          "the light that falls on others (emissiveFactor; the camera sees it) of "
                          "1 material",
                          "transparency (alphaMode) of 1 material",
                          "occlusionTexture of 1 material", "vertex colours (COLOR_0) of 1 mesh",
                          "clamping and mirroring of 1 sampler", "KHR_materials_clearcoat"));
  // A scene's own material replaces them, and what they lack with it.
  geometry.materials.push_back({"mine"});
  EXPECT_THAT(AppendMesh(path, {}, 0u, geometry),
              ElementsAre("the light (KHR_lights_punctual) of 2 lamps"));
  EXPECT_THAT(AppendMesh(Builder().Triangle().Save(), {}, 0u, geometry), testing::IsEmpty());
}

TEST(Gltf, PackedVerticesAreRefusedByName) {
  for (const char* name : {"KHR_mesh_quantization", "EXT_meshopt_compression"}) {
    Builder builder;
    builder.Triangle().json["extensionsUsed"] = {name};
    ExpectRefused(builder, name);
  }
}

TEST(Gltf, TreesThatAreNoneAreRefused) {
  Builder loop;
  loop.Triangle().json["nodes"] = Json::parse(R"([{"mesh":0,"children":[1]},{"children":[0]}])");
  ExpectRefused(loop, "twice");
  Builder chain;
  chain.Triangle();
  for (int i = 0; i < 3000; ++i) chain.json["nodes"][i]["children"] = {i + 1};
  chain.json["nodes"].push_back({{"mesh", 0}});
  ExpectRefused(chain, "1000 deep");
  EXPECT_THAT([] { Read(Write("nested.gltf", std::string(200000, '['))); },
              testing::ThrowsMessage<InputError>(HasSubstr("nested.gltf")));
}

TEST(Gltf, SeveralRootsAndNoSceneNumber) {
  Builder builder;
  builder.Triangle();
  builder.json["nodes"] =
      Json::parse(R"([{"mesh":0,"translation":[5,0,0]},{"mesh":0,"translation":[7,0,0]}])");
  builder.json["scenes"] = Json::parse(R"([{"nodes":[1,0]}])");
  builder.json.erase("scene");
  const Geometry geometry = Read(builder.Save());
  ASSERT_EQ(geometry.triangles.size(), 2u);
  EXPECT_EQ(geometry.corner(0, 0)[0], 7);
  EXPECT_EQ(geometry.corner(1, 0)[0], 5);
}

TEST(Gltf, PicturesBesideItMayHaveBlanksInTheirNames) {
  Builder builder;
  builder.Triangle().Textures().Material(
      Json::parse(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})"));
  builder.json["images"][0]["uri"] = "with%20blank.png";
  const auto path = builder.Save();
  std::filesystem::remove(Folder() / "with blank.png");
  EXPECT_THAT([&] { Read(path); }, testing::ThrowsMessage<InputError>(HasSubstr("with blank.png")));
  const Texture texture{"t", 1, 1, {0xFF336699u}};
  const cv::Mat pixel(1, 1, CV_8UC3, cv::Scalar(0x33, 0x66, 0x99));
  cv::imwrite((Folder() / "with blank.png").string(), pixel);
  EXPECT_EQ(Read(path).textures.at(0).rgba, texture.rgba);
}

}  // namespace
}  // namespace luxfield::scene
