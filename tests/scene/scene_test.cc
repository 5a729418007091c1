#include "luxfield/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "luxfield/core/error.h"

namespace luxfield::scene {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::filesystem::path Write(const std::string& text) {
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_scene_test.toml";
  std::ofstream(path) << text;
  return path;
}

constexpr char kCamera[] =
    "[camera]\nposition = [0, -5, 2]\nlook_at = [0, 0, 1]\nwidth = 40\nheight = 30\n";
constexpr char kGround[] =
    "[[material]]\nname = \"grey\"\nalbedo = [0.2, 0.3, 0.4]\n"
    "[[quad]]\ncorner = [-1, -1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\nmaterial = \"grey\"\n";

// Reading kCamera + text fails with a message that holds all of `parts`.
void ExpectError(const std::string& text, const std::vector<std::string>& parts) {
  const auto path = Write(kCamera + text);
  try {
    ReadScene(path);
    FAIL() << "accepted: " << text;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("luxfield_scene_test.toml"));
    for (const auto& part : parts) EXPECT_THAT(error.what(), HasSubstr(part));
  }
}

TEST(Scene, ReadsPrimitivesMaterialsAndCamera) {
  const auto scene =
      ReadScene(Write(std::string(kCamera) + kGround +
                      "[[box]]\nsize = [2, 4, 6]\nposition = [0, 0, 3]\nmaterial = \"grey\"\n"));
  EXPECT_EQ(scene.geometry.triangles.size(), 2u + 12u);
  EXPECT_THAT(scene.geometry.materials[0].albedo, testing::ElementsAre(0.2f, 0.3f, 0.4f));
  float top = -1;
  for (const auto& vertex : scene.geometry.vertices) top = std::max(top, vertex.position[2]);
  EXPECT_FLOAT_EQ(top, 6);
  EXPECT_EQ(scene.camera.width, 40);
  // The middle of the picture looks at the target; the top half looks up, the right half right.
  const Vec3 middle = scene.camera.Direction(20, 15);
  EXPECT_NEAR(lightfield::Length(lightfield::Cross(middle, Vec3{0, 5, -1})), 0, 1e-14);
  EXPECT_GT(scene.camera.Direction(20, 0).z, middle.z);
  EXPECT_GT(scene.camera.Direction(40, 15).x, 0);
  // vertical_fov_deg defaults to 40 between the upper and the lower edge.
  const double cosine = lightfield::Dot(lightfield::Normalized(scene.camera.Direction(20, 0)),
                                        lightfield::Normalized(scene.camera.Direction(20, 30)));
  EXPECT_NEAR(std::acos(cosine) * 180 / M_PI, 40, 1e-10);
}

TEST(Scene, ReadsKindsOfMaterials) {
  const auto scene =
      ReadScene(Write(std::string(kCamera) +
                      "[[material]]\nname = \"a\"\nalbedo = [0.2, 0.3, 0.4]\n"
                      "[[material]]\nname = \"b\"\nkind = \"phong\"\nalbedo = [0.2, 0.3, 0.4]\n"
                      "specular = [0.8, 0.7, 0.6]\nexponent = 50\n"
                      "[[material]]\nname = \"c\"\nkind = \"ggx\"\nalbedo = [1, 0.8, 0.3]\n"
                      "metallic = 1\nroughness = 0\n"));
  const auto& materials = scene.geometry.materials;
  ASSERT_EQ(materials.size(), 3u);
  EXPECT_EQ(materials[0].kind, MaterialKind::kLambert);
  EXPECT_FALSE(IsGlossy(materials[0]));
  EXPECT_EQ(materials[1].kind, MaterialKind::kPhong);
  EXPECT_THAT(materials[1].specular, testing::ElementsAre(0.8f, 0.7f, 0.6f));
  EXPECT_EQ(materials[1].exponent, 50);
  EXPECT_EQ(materials[2].kind, MaterialKind::kGgx);
  EXPECT_EQ(materials[2].metallic, 1);
  EXPECT_EQ(materials[2].roughness, 0);
  EXPECT_TRUE(IsGlossy(materials[2]));
}

TEST(Scene, MaterialErrorsNameTheField) {
  const auto material = [](const std::string& keys) {
    return "[[material]]\nname = \"m\"\nalbedo = [0.5, 0.5, 0.5]\n" + keys;
  };
  ExpectError(material("kind = \"mirror\"\n"), {"kind", "mirror", "ggx"});
  ExpectError(material("kind = \"phong\"\nspecular = [0.1, 0.6, 0.1]\nexponent = 2\n"),
              {"specular", "0.6", "channel g"});
  ExpectError(material("kind = \"phong\"\nspecular = [0, -1, 0]\nexponent = 2\n"),
              {"specular", "-1"});
  ExpectError(material("kind = \"phong\"\nspecular = [0, 0, 0]\nexponent = -0.1\n"),
              {"exponent", "-0.1"});
  ExpectError(material("kind = \"phong\"\nspecular = [0, 0, 0]\nexponent = 1e7\n"), {"exponent"});
  ExpectError(material("kind = \"phong\"\nexponent = 2\n"), {"specular"});
  ExpectError(material("kind = \"ggx\"\n"), {"roughness"});
  ExpectError(material("kind = \"ggx\"\nroughness = 1.01\n"), {"roughness", "1.01"});
  ExpectError(material("kind = \"ggx\"\nroughness = 1\nmetallic = nan\n"), {"metallic"});
  ExpectError(material("kind = \"ggx\"\nroughness = 1\nexponent = 3\n"), {"exponent"});
  ExpectError(material("specular = [0, 0, 0]\n"), {"specular"});
  EXPECT_THAT([&] { ReadScene(Write(kCamera + material("normal_texture = \"no.png\"\n"))); },
              ThrowsMessage<InputError>(HasSubstr("no.png")));
}

TEST(Scene, ReadsAnEnvironment) {
  EXPECT_FALSE(ReadScene(Write(kCamera)).environment);
  const auto plain = ReadScene(Write(std::string(kCamera) + "[environment]\nfile = \"sky.hdr\"\n"));
  ASSERT_TRUE(plain.environment);
  EXPECT_EQ(plain.environment->file, std::filesystem::path(testing::TempDir()) / "sky.hdr");
  EXPECT_FALSE(plain.environment->layout);
  EXPECT_EQ(plain.environment->scale, 1);
  EXPECT_EQ(plain.environment->face_size, 0);
  EXPECT_EQ(plain.environment->world_from_environment.Vector({1, 2, 3}).y, 2);
  const auto all =
      ReadScene(Write(std::string(kCamera) +
                      "[environment]\nfile = \"/a/ball.exr\"\nlayout = \"mirror-ball\"\n"
                      "rotate_deg = [0, 0, 90]\nscale = 0.25\nface_size = 64\n"));
  EXPECT_EQ(all.environment->file, "/a/ball.exr");
  EXPECT_EQ(all.environment->layout, environment::EnvironmentLayout::kMirrorBall);
  EXPECT_EQ(all.environment->scale, 0.25);
  EXPECT_EQ(all.environment->face_size, 64);
  EXPECT_NEAR(all.environment->world_from_environment.Vector({1, 0, 0}).y, 1, 1e-15);
}

TEST(Scene, ReadsLuminairesAndOverridesThem) {
  const std::string text =
      std::string(kCamera) +
      "[[luminaire]]\nname = \"left\"\nfile = \"a.lf.exr\"\ntables = \"a.tab.exr\"\n"
      "position = [1, 2, 3]\nlook_at = [1, 9, 3]\nscale = 2.5\ncolour = [0, 0.5, 3]\n"
      "[[luminaire]]\nfile = \"/b.lf.exr\"\nposition = [0, 0, 1]\nrotate_deg = [-90, 0, 0]\n";
  const auto scene = ReadScene(Write(text));
  ASSERT_EQ(scene.luminaires.size(), 2u);
  EXPECT_EQ(scene.luminaires[0].light_field,
            std::filesystem::path(testing::TempDir()) / "a.lf.exr");
  EXPECT_DOUBLE_EQ(scene.luminaires[0].scale, 2.5);
  EXPECT_THAT(scene.luminaires[0].colour, testing::ElementsAre(0, 0.5, 3));
  EXPECT_THAT(scene.luminaires[1].colour, testing::ElementsAre(1, 1, 1));
  EXPECT_NEAR(scene.luminaires[0].world_from_luminaire.Vector({0, 0, 1}).y, 1, 1e-15);
  EXPECT_EQ(scene.luminaires[1].name, "luminaire 2");
  EXPECT_EQ(scene.luminaires[1].light_field, "/b.lf.exr");
  EXPECT_NEAR(scene.luminaires[1].world_from_luminaire.Vector({0, 0, 1}).y, 1, 1e-15);

  SceneOverrides overrides;
  overrides.light_fields["left"] = "new.lf.exr";
  overrides.width = 8;
  const auto changed = ReadScene(Write(text), overrides);
  EXPECT_EQ(changed.luminaires[0].light_field, "new.lf.exr");
  EXPECT_TRUE(changed.luminaires[0].tables.empty());
  EXPECT_EQ(changed.luminaires[1].light_field, "/b.lf.exr");
  EXPECT_EQ(changed.camera.width, 8);
  EXPECT_EQ(changed.camera.height, 30);

  overrides = {};
  overrides.light_fields["*"] = "all.lf.exr";
  overrides.tables["left"] = "all.tab.exr";
  const auto all = ReadScene(Write(text), overrides);
  EXPECT_EQ(all.luminaires[0].light_field, "all.lf.exr");
  EXPECT_EQ(all.luminaires[0].tables, "all.tab.exr");
  EXPECT_EQ(all.luminaires[1].light_field, "all.lf.exr");

  overrides.light_fields["right"] = "x.lf.exr";
  EXPECT_THAT([&] { ReadScene(Write(text), overrides); },
              ThrowsMessage<InputError>(HasSubstr("'right'")));
  overrides = {};
  overrides.height = 0;
  EXPECT_THROW(ReadScene(Write(text), overrides), InputError);
}

TEST(Scene, ReadsAreaLights) {
  const auto scene =
      ReadScene(Write(std::string(kCamera) +
                      "[[light]]\nkind = \"rectangle\"\nradiance = [1, 2, 3]\nsize = [0.5, 2]\n"
                      "position = [1, 2, 3]\nlook_at = [1, 2, 0]\nup = [0, 1, 0]\n"
                      "[[light]]\nname = \"sun\"\nkind = \"sphere\"\nradiance = [1e6, 1e6, 0]\n"
                      "radius = 0.25\nposition = [4, 5, 6]\n"));
  ASSERT_EQ(scene.area_lights.size(), 2u);
  const AreaLight &rectangle = scene.area_lights[0], &sphere = scene.area_lights[1];
  EXPECT_EQ(rectangle.name, "light 1");
  EXPECT_EQ(rectangle.kind, AreaLightKind::kRectangle);
  EXPECT_THAT(rectangle.radiance, testing::ElementsAre(1, 2, 3));
  EXPECT_EQ(rectangle.width_m, 0.5);
  EXPECT_EQ(rectangle.height_m, 2);
  EXPECT_NEAR(rectangle.world_from_light.Vector({0, 0, 1}).z, -1, 1e-15);
  EXPECT_NEAR(rectangle.world_from_light.Vector({0, 1, 0}).y, 1, 1e-15);
  EXPECT_EQ(rectangle.world_from_light.Point({}).z, 3);
  EXPECT_EQ(sphere.name, "sun");
  EXPECT_EQ(sphere.kind, AreaLightKind::kSphere);
  EXPECT_EQ(sphere.radius_m, 0.25);
  EXPECT_EQ(sphere.world_from_light.Point({}).y, 5);
}

TEST(Scene, ReadsClassicalLights) {
  const std::string text =
      std::string(kCamera) +
      "[[luminaire]]\nmodel = \"point\"\ndistribution = \"spot.ies\"\nposition = [1, 2, 3]\n"
      "look_at = [1, 2, 0]\nup = [0, 1, 0]\nscale = 0.5\ncolour = [1, 0.5, 0.25]\n"
      "[[luminaire]]\nname = \"lamp\"\nfile = \"a.lf.exr\"\nposition = [0, 0, 1]\n"
      "[[luminaire]]\nname = \"tube\"\nmodel = \"linear\"\ndistribution = \"/tube.ldt\"\n"
      "size = [0, 1.2]\nposition = [0, 0, 2]\n[[luminaire.array]]\ncount = 2\nstep = [3, 0, 0]\n"
      "[[luminaire]]\nmodel = \"area\"\ndistribution = \"panel.gldf\"\nposition = [0, 0, 2]\n";
  const auto scene = ReadScene(Write(text));
  ASSERT_EQ(scene.luminaires.size(), 1u);
  EXPECT_EQ(scene.luminaires[0].name, "lamp");
  ASSERT_EQ(scene.classical_lights.size(), 4u);
  const ClassicalLight &point = scene.classical_lights[0], &tube = scene.classical_lights[2],
                       &panel = scene.classical_lights[3];
  EXPECT_EQ(point.name, "luminaire 1");
  EXPECT_EQ(point.model, ClassicalModel::kPoint);
  EXPECT_EQ(point.distribution.filename(), "spot.ies");
  EXPECT_FALSE(point.size_m);
  EXPECT_EQ(point.scale, 0.5);
  EXPECT_NEAR(point.world_from_light.Vector({0, 0, 1}).z, -1, 1e-15);
  EXPECT_EQ(tube.name, "tube");
  EXPECT_EQ(tube.model, ClassicalModel::kLinear);
  EXPECT_EQ(tube.distribution, "/tube.ldt");
  EXPECT_EQ(tube.size_m, (std::array{0.0, 1.2}));
  EXPECT_EQ(tube.world_from_light.translation.x, 3);
  EXPECT_EQ(panel.name, "luminaire 4");
  EXPECT_EQ(panel.model, ClassicalModel::kArea);
  EXPECT_FALSE(panel.size_m);
}

TEST(Scene, RefusesClassicalLightsByName) {
  const auto expect = [](const std::string& keys, const std::string& message) {
    EXPECT_THAT(
        [&] {
          ReadScene(Write(std::string(kCamera) + "[[luminaire]]\nposition = [0, 0, 2]\n" + keys));
        },
        ThrowsMessage<InputError>(HasSubstr(message)))
        << keys;
  };
  const std::string file = "distribution = \"a.ies\"\n";
  expect("model = \"spot\"\n" + file, "use one of: point, linear, area");
  expect("model = \"point\"\n", "distribution is missing");
  expect("model = \"point\"\nfile = \"a.lf.exr\"\n" + file, "is a light field's");
  expect(file + "file = \"a.lf.exr\"\n", "is given without a model");
  expect("model = \"point\"\nsize = [1, 1]\n" + file, "size is not a known key");
  expect("model = \"linear\"\nsize = [1, 1]\n" + file, "is no line");
  expect("model = \"linear\"\nsize = [0, 0]\n" + file, "is no line");
  expect("model = \"area\"\nsize = [1, 0]\n" + file, "size = 0 is outside");
  expect("model = \"area\"\nsize = [1, 2, 3]\n" + file, "size has 3 entries");
}

// An array's copies stand at multiples of its step from the first, share its name and file, and
// combine with those of other arrays.
TEST(Scene, ArraysMakeCopies) {
  const std::string text = std::string(kCamera) +
                           "[[luminaire]]\nname = \"row\"\nfile = \"a.lf.exr\"\n"
                           "position = [1, 2, 3]\nlook_at = [1, 2, 0]\nup = [0, 1, 0]\nscale = 2\n"
                           "[[luminaire.array]]\ncount = 3\nstep = [0, 10, 0]\n"
                           "[[luminaire.array]]\ncount = 2\nstep = [-4, 0, 1]\n"
                           "[[luminaire]]\nfile = \"b.lf.exr\"\nposition = [0, 0, 1]\n"
                           "[[light]]\nkind = \"sphere\"\nradiance = [1, 1, 1]\nradius = 0.1\n"
                           "position = [0, 0, 5]\n[[light.array]]\ncount = 4\nstep = [1, 0, 0]\n";
  SceneOverrides overrides;
  overrides.light_fields["row"] = "c.lf.exr";
  const auto scene = ReadScene(Write(text), overrides);
  ASSERT_EQ(scene.luminaires.size(), 7u);
  for (int k = 0; k < 6; ++k) {
    const Luminaire& lamp = scene.luminaires[k];
    EXPECT_EQ(lamp.name, "row");
    EXPECT_EQ(lamp.light_field, "c.lf.exr");
    EXPECT_EQ(lamp.scale, 2);
    EXPECT_NEAR(lamp.world_from_luminaire.Vector({0, 0, 1}).z, -1, 1e-15);
    const Vec3 p = lamp.world_from_luminaire.Point({});
    EXPECT_NEAR(p.x, 1 - 4 * (k / 3), 1e-12);
    EXPECT_NEAR(p.y, 2 + 10 * (k % 3), 1e-12);
    EXPECT_NEAR(p.z, 3 + k / 3, 1e-12);
  }
  EXPECT_EQ(scene.luminaires[6].name, "luminaire 2");
  ASSERT_EQ(scene.area_lights.size(), 4u);
  EXPECT_EQ(scene.area_lights[3].world_from_light.Point({}).x, 3);
  EXPECT_EQ(scene.area_lights[3].name, scene.area_lights[0].name);
}

TEST(Scene, ArraysMakeCopiesOfGeometry) {
  const std::string grid =
      "[[quad.array]]\ncount = 2\nstep = [0, 3, 0]\n"
      "[[box]]\nsize = [1, 1, 1]\nposition = [0, 0, 2]\nmaterial = \"grey\"\n"
      "[[box.array]]\ncount = 3\nstep = [2, 0, 0]\n";
  const auto scene = ReadScene(Write(std::string(kCamera) + kGround + grid));
  ASSERT_EQ(scene.geometry.triangles.size(), 2u * 2 + 3 * 12);
  float low_x = 1e9f, high_x = -1e9f, high_y = -1e9f;
  for (const Vertex& vertex : scene.geometry.vertices) {
    low_x = std::min(low_x, vertex.position[0]);
    high_x = std::max(high_x, vertex.position[0]);
    high_y = std::max(high_y, vertex.position[1]);
  }
  EXPECT_FLOAT_EQ(low_x, -1);
  EXPECT_FLOAT_EQ(high_x, 4.5f);  // the third box
  EXPECT_FLOAT_EQ(high_y, 4);     // the second quad
}

TEST(Scene, ArrayErrorsNameTheField) {
  const std::string lamp =
      "[[luminaire]]\nfile = \"a.lf.exr\"\nposition = [0, 0, 1]\n[[luminaire.array]]\n";
  ExpectError(lamp + "step = [1, 0, 0]\n", {"luminaire[0].array[0].count"});
  ExpectError(lamp + "count = 0\nstep = [1, 0, 0]\n", {"count", "0"});
  ExpectError(lamp + "count = 3\n", {"luminaire[0].array[0].step"});
  ExpectError(lamp + "count = 3\nstep = [1, 0, 0]\ngap = 1\n", {"gap"});
  ExpectError(lamp +
                  "count = 2000\nstep = [1, 0, 0]\n"
                  "[[luminaire.array]]\ncount = 501\nstep = [0, 1, 0]\n",
              {"count", "501", "1000000"});
  ExpectError(lamp + "count = 3\nstep = [6e5, 0, 0]\n", {"array", "1200000", "origin"});
}

TEST(Scene, AreaLightErrorsNameTheField) {
  const auto light = [](const std::string& keys) {
    return "[[light]]\nposition = [0, 0, 1]\n" + keys;
  };
  const std::string white = "radiance = [1, 1, 1]\n", rectangle = "kind = \"rectangle\"\n",
                    sphere = "kind = \"sphere\"\n";
  ExpectError(light(white + "kind = \"disc\"\n"), {"light", "kind", "disc", "sphere"});
  ExpectError(light(white + rectangle), {"light", "size"});
  ExpectError(light(white + rectangle + "size = [1, 0]\n"), {"size", "= 0"});
  ExpectError(light(white + rectangle + "size = [1, 1]\nradius = 1\n"), {"radius"});
  ExpectError(light(white + sphere), {"light", "radius"});
  ExpectError(light(white + sphere + "radius = -1\n"), {"radius", "-1"});
  ExpectError(light(white + sphere + "radius = 1\nrotate_deg = [0, 0, 0]\n"), {"rotate_deg"});
  ExpectError(light("radiance = [1, -2, 1]\nradius = 1\n" + sphere), {"radiance", "-2"});
  ExpectError(light(white + sphere + "radius = 1\nname = \"a\"\n") +
                  light(white + sphere + "radius = 1\nname = \"a\"\n"),
              {"name", "taken"});
}

TEST(Scene, AnEmptyWorldIsLegal) {
  const auto scene = ReadScene(Write(kCamera));
  EXPECT_TRUE(scene.geometry.triangles.empty());
  EXPECT_TRUE(scene.luminaires.empty());
}

TEST(Scene, ErrorsNameFileAndField) {
  ExpectError("environment = \"sky.hdr\"\n",
              {"camera.environment"});  // inside [camera]: unknown key
  const auto environment = [](const std::string& keys) {
    return "[environment]\nfile = \"sky.hdr\"\n" + keys;
  };
  ExpectError("[environment]\n", {"environment.file"});
  ExpectError(environment("layout = \"panorama\"\n"),
              {"environment.layout", "panorama", "latitude-longitude"});
  ExpectError(environment("scale = -1\n"), {"environment.scale", "-1"});
  ExpectError(environment("face_size = 8193\n"), {"environment.face_size", "8193"});
  ExpectError(environment("face_size = 1.5\n"), {"environment.face_size"});
  ExpectError(environment("rotate_deg = [0, 90]\n"), {"environment.rotate_deg"});
  ExpectError(environment("position = [0, 0, 0]\n"), {"position"});
  ExpectError("zoom = 2\n", {"camera.zoom"});
  ExpectError("[[quad]]\ncorner = [0, 0]\n", {"quad", "corner"});
  ExpectError("[[box]]\nsize = [1, 1, 1]\nmaterial = \"gold\"\n", {"box", "material", "gold"});
  ExpectError(std::string(kGround) + "[[box]]\nsize = [1, 0, 1]\nmaterial = \"grey\"\n",
              {"box", "size"});
  ExpectError("[[material]]\nname = \"m\"\nalbedo = [0.5, 1.5, 0]\n", {"albedo", "1.5"});
  ExpectError("[[material]]\nname = \"m\"\nalbedo = [0, nan, 0]\n", {"albedo"});
  ExpectError(
      "[[material]]\nname = \"m\"\nalbedo = [0, 0, 0]\n[[material]]\nname = \"m\"\nalbedo = [0, 0, "
      "0]\n",
      {"name", "twice"});
  ExpectError("[[mesh]]\nfile = \"nowhere.obj\"\n", {"mesh", "file", "nowhere.obj"});
  ExpectError(std::string(kGround) +
                  "[[quad]]\ncorner = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [2, 0, 0]\n"
                  "material = \"grey\"\n",
              {"edge_v"});
  const std::string lamp = "[[luminaire]]\nfile = \"a.lf.exr\"\n";
  ExpectError(lamp, {"luminaire", "position"});
  ExpectError(lamp + "position = [0, 0, 2e6]\n", {"position", "2000000"});
  ExpectError(lamp + "position = [0, 0, 1]\nlook_at = [0, 0, 1]\n", {"look_at"});
  ExpectError(lamp + "position = [0, 0, 1]\nlook_at = [0, 0, 3]\n", {"up"});
  ExpectError(lamp + "position = [0, 0, 1]\nlook_at = [0, 1, 3]\nrotate_deg = [0, 0, 0]\n",
              {"rotate_deg"});
  ExpectError(lamp + "position = [0, 0, 1]\nscale = -1\n", {"scale", "-1"});
  ExpectError(lamp + "position = [0, 0, 1]\ncolour = [1, -2, 1]\n", {"colour", "-2", "three"});
  ExpectError(lamp + "position = [0, 0, 1]\ncolour = [1, 1]\n", {"colour"});
  ExpectError("[[luminaire]]\nposition = [0, 0, 1]\n", {"file"});
}

TEST(Scene, BadFilesAreRefused) {
  EXPECT_THROW(ReadScene("/nowhere/scene.toml"), InputError);
  EXPECT_THROW(ReadScene(Write("[camera\n")), InputError);
  EXPECT_THROW(ReadScene(Write("")), InputError);
  EXPECT_THROW(ReadScene(Write(std::string("\x00\xff\x10", 3))), InputError);
}

}  // namespace
}  // namespace luxfield::scene
