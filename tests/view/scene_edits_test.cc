// Lamps, materials, environment and views are written back into scene.toml without a change of
// anything else.
#include "luxfield/view/scene_file/scene_edits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/scene/named_view.h"
#include "luxfield/scene/scene.h"
#include "luxfield/view/scene_file/scene_editor.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;

constexpr char kText[] = R"(# Two lamps. Für jeden eine Zeile.
[camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.2]

[environment]
file = "sky.exr"  # blue

[[material]]
name = "grey"
albedo = [0.5, 0.4, 0.3]
[[material]]
name = "gloss"
kind = "ggx"
albedo = [0.9, 0.9, 0.9]
roughness = 0.5
[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 8, 0]
material = "grey"

[[luminaire]]  # the left one
name = "left"
file = "a.lf.exr"
position = [ 0, 0,
             0.6 ]  # metres
look_at = [0, 5, 0.3]

)";

// And one that is turned by angles, with letters of two bytes behind it.
std::string Text() {
  return std::string(kText) +
         "# Of the second.\n[[luminaire]]\nfile = \"b.lf.exr\"\ntables = \"b.tab.exr\"\nposition = "
         "[1, 0, 0.6]  # r\xC3\xA9gl\xC3\xA9\n"
         "rotate_deg = [ -90,0,0 ]\nscale = 2 # twice\n";
}

class SceneEditsTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::path(testing::TempDir()) / ("luxfield_lamps_" + std::to_string(getpid()) + ".toml");
    std::ofstream(file_, std::ios::binary) << Text();
  }
  void TearDown() override { fs::remove(file_); }
  fs::path file_;
};

TEST_F(SceneEditsTest, ReadsWhatTheScenesReaderReads) {
  const SceneEdits edits = ReadSceneEdits(file_);
  const scene::Scene scene = scene::ReadScene(file_);
  ASSERT_EQ(edits.lamps.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto pose = edits.lamps[i].WorldFromLuminaire();
    ASSERT_TRUE(pose);
    EXPECT_EQ(edits.lamps[i].name, scene.luminaires[i].name);
    EXPECT_EQ(pose->linear, scene.luminaires[i].world_from_luminaire.linear);
    EXPECT_EQ(pose->translation.x, scene.luminaires[i].world_from_luminaire.translation.x);
    EXPECT_EQ(edits.lamps[i].scale, scene.luminaires[i].scale);
    EXPECT_EQ(file_.parent_path() / edits.lamps[i].file, scene.luminaires[i].light_field);
  }
}

TEST_F(SceneEditsTest, WithoutAChangeEveryByteStays) {
  const SceneEdits edits = ReadSceneEdits(file_);
  EXPECT_EQ(WithEdits(Text(), edits, edits, "f"), Text());
}

TEST_F(SceneEditsTest, ChangedValuesStandWhereTheOldOnesStoodAndCommentsStay) {
  const SceneEdits was = ReadSceneEdits(file_);
  SceneEdits is = was;
  is.lamps[0].position = {0.1, -2, 0.75};
  is.lamps[0].scale = 0.5;  // had no key
  is.lamps[1].colour = {1, 0.5, 0.25};
  is.lamps[1].rotate_deg = {-90, 0, 12.5};
  is.lamps[1].scale = 3;
  is.lamps[1].file = "other \"b\".lf.exr";
  is.lamps[1].tables.clear();
  is.materials[0].albedo = {0.25, 0.5, 1};
  is.materials[1].roughness = 0.75;
  is.materials[1].metallic = 1;  // had no key
  is.environment->rotate_deg = {0, 0, 45};
  SaveSceneEdits(file_, was, is);
  std::string expected = Text();
  const auto replace = [&](const std::string& from, const std::string& to) {
    expected.replace(expected.find(from), from.size(), to);
  };
  replace("[ 0, 0,\n             0.6 ]  # metres\n", "[0.1, -2, 0.75]  # metres\nscale = 0.5\n");
  replace("[ -90,0,0 ]", "[-90, 0, 12.5]");
  replace("scale = 2 # twice", "scale = 3 # twice");
  replace("[1, 0, 0.6]  # r\xC3\xA9gl\xC3\xA9\n",
          "[1, 0, 0.6]  # r\xC3\xA9gl\xC3\xA9\ncolour = [1, 0.5, 0.25]\n");
  replace("\"b.lf.exr\"", R"("other \"b\".lf.exr")");
  replace("tables = \"b.tab.exr\"\n", "");
  replace("[0.5, 0.4, 0.3]", "[0.25, 0.5, 1]");
  replace("roughness = 0.5", "roughness = 0.75");
  replace("[0.9, 0.9, 0.9]\n", "[0.9, 0.9, 0.9]\nmetallic = 1\n");
  replace("\"sky.exr\"  # blue\n", "\"sky.exr\"  # blue\nrotate_deg = [0, 0, 45]\n");
  EXPECT_EQ(core::ReadFile(file_), expected);
  EXPECT_EQ(ReadSceneEdits(file_), is);
}

// Lights that shine by a photometric file, among lamps that are light fields.
TEST_F(SceneEditsTest, ClassicalLightsAreMovedDimmedAndSavedLikeLamps) {
  const std::string light =
      "[[luminaire]]  # a tube\nmodel = \"linear\"\ndistribution = \"tube.ies\"  # 28 W\n"
      "size = [1.2, 0]\nposition = [0, 2, 2.4]  # at the ceiling\nlook_at = [0, 2, 0]\n"
      "up = [0, 1, 0]\n";
  const std::string text = light + Text();
  std::ofstream(file_, std::ios::binary) << text;
  const scene::Scene scene = scene::ReadScene(file_);
  SceneEditor editor(scene);
  ASSERT_EQ(editor.lamps().size(), 3);
  LampPlacement tube = editor.lamps()[0];
  EXPECT_EQ(tube.model, "linear");
  tube.position = {0.5, 2, 2.25};
  tube.scale = 0;
  ASSERT_TRUE(editor.Set(0, tube));
  editor.Exchange(0, "a.lf.exr");  // which it does not have
  EXPECT_EQ(editor.lamps()[0], tube);
  editor.Duplicate(0, {1, 0, 0});
  editor.Save();
  std::string expected = text;
  expected.replace(expected.find("[0, 2, 2.4]  # at the ceiling\n"), 30,
                   "[0.5, 2, 2.25]  # at the ceiling\nscale = 0\n");
  expected +=
      "\n[[luminaire]]\nname = \"luminaire 1 2\"\nmodel = \"linear\"\n"
      "distribution = \"tube.ies\"\nsize = [1.2, 0]\nposition = [1.5, 2, 2.25]\n"
      "look_at = [1, 2, 0]\nup = [0, 1, 0]\nscale = 0\n";
  EXPECT_EQ(core::ReadFile(file_), expected);
  const scene::Scene edited = editor.Apply(scene), read = scene::ReadScene(file_);
  ASSERT_EQ(edited.classical_lights.size(), 2);
  ASSERT_EQ(edited.luminaires.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const scene::ClassicalLight &a = edited.classical_lights[i], &b = read.classical_lights[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.model, b.model);
    EXPECT_EQ(a.distribution, b.distribution);
    EXPECT_EQ(a.size_m, b.size_m);
    EXPECT_EQ(a.world_from_light.linear, b.world_from_light.linear);
    EXPECT_EQ(a.world_from_light.translation.x, b.world_from_light.translation.x);
    EXPECT_EQ(a.scale, b.scale);
  }
}

// New ones stand at the end, those that are gone leave nothing behind, and lamps without a name keep
// that of their number.
TEST_F(SceneEditsTest, LampsAndViewsComeAndGo) {
  const SceneEdits was = ReadSceneEdits(file_);
  SceneEdits is = was;
  LampPlacement copy = is.lamps[1];
  copy.name = "luminaire 2 2";
  copy.position.x = -1;
  copy.colour = {1, 0, 0};
  is.lamps.push_back(copy);
  is.views.push_back({"from \"above\"", {0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 30});
  SaveSceneEdits(file_, was, is);
  const std::string with = core::ReadFile(file_);
  EXPECT_EQ(with.substr(0, Text().size()), Text());
  EXPECT_EQ(with.substr(Text().size()), R"(
[[luminaire]]
name = "luminaire 2 2"
file = "b.lf.exr"
tables = "b.tab.exr"
position = [-1, 0, 0.6]
rotate_deg = [-90, 0, 0]
scale = 2
colour = [1, 0, 0]

[[view]]
name = "from \"above\""
position = [0, 0, 5]
look_at = [0, 0, 0]
up = [0, 1, 0]
vertical_fov_deg = 30
)");
  EXPECT_EQ(ReadSceneEdits(file_), is);
  const scene::Scene scene = scene::ReadScene(file_);
  ASSERT_EQ(scene.luminaires.size(), 3);
  EXPECT_EQ(scene.luminaires[2].colour, copy.colour);
  const scene::Camera camera = scene::ReadNamedView(file_, "from \"above\"", scene.camera);
  EXPECT_EQ(camera.position.z, 5);
  EXPECT_EQ(camera.width, scene.camera.width);
  EXPECT_THROW(scene::ReadNamedView(file_, "above", scene.camera), InputError);

  // What was saved, back to what it was, but for the order of bytes that say nothing.
  SaveSceneEdits(file_, is, was);
  EXPECT_EQ(ReadSceneEdits(file_), was);
  EXPECT_EQ(core::ReadFile(file_).substr(0, Text().size()), Text());

  // Without the first lamp the other keeps its name, and comments above the next table stay.
  SceneEdits one = was;
  one.lamps.erase(one.lamps.begin());
  SaveSceneEdits(file_, was, one);
  EXPECT_EQ(ReadSceneEdits(file_), one);
  const std::string left = core::ReadFile(file_);
  EXPECT_THAT(left, testing::HasSubstr("# Of the second.\n[[luminaire]]"));
  EXPECT_THAT(left, testing::Not(testing::HasSubstr("the left one")));
}

TEST_F(SceneEditsTest, AFileWithOtherThingsIsLeftAlone) {
  const SceneEdits was = ReadSceneEdits(file_);
  for (int what = 0; what < 5; ++what) {
    SceneEdits other = was;
    if (what == 0) other.lamps.pop_back();
    if (what == 1) other.lamps[0].name = "right";
    if (what == 2) other.materials[0].name = "green";
    if (what == 3) other.views.push_back({"x", {}, {1, 0, 0}, {0, 0, 1}, 40});
    if (what == 4) other.environment.reset();
    EXPECT_THROW(SaveSceneEdits(file_, other, was), InputError) << what;
  }
  EXPECT_EQ(core::ReadFile(file_), Text());
}

// Where lines cannot be added, nothing is written.
TEST_F(SceneEditsTest, InlineTablesAreRefusedRatherThanSpoilt) {
  const std::string text =
      "luminaire = [{name = \"a\", file = \"a.lf.exr\", position = [0, 0, 1], rotate_deg = [0, 0, "
      "0]}]\n";
  std::ofstream(file_, std::ios::binary) << text;
  const SceneEdits was = ReadSceneEdits(file_);
  SceneEdits is = was;
  is.lamps[0].scale = 2;
  EXPECT_THROW(SaveSceneEdits(file_, was, is), InputError);
  EXPECT_EQ(core::ReadFile(file_), text);
  is = was;
  is.lamps[0].position.x = 3;  // in place of what is there
  SaveSceneEdits(file_, was, is);
  EXPECT_EQ(ReadSceneEdits(file_), is);
}

// What is lit is what would be read from the file once it is saved.
TEST_F(SceneEditsTest, TheEditedSceneIsThatOfTheSavedFile) {
  const SceneEdits was = ReadSceneEdits(file_);
  const scene::Scene before = scene::ReadScene(file_);
  SceneEdits is = was;
  is.lamps[0].position.y = -1;
  is.lamps[1].file = "c.lf.exr";
  is.lamps.push_back(is.lamps[0]);
  is.lamps.back().name = "copy";
  is.materials[0].albedo[1] = 0.75;
  is.materials[1].roughness = 0.25;
  is.environment = EnvironmentNumbers{{10, 20, 30}, 4};
  const scene::Scene edited = Edited(before, was, is);
  SaveSceneEdits(file_, was, is);
  const scene::Scene after = scene::ReadScene(file_);
  ASSERT_EQ(edited.luminaires.size(), after.luminaires.size());
  for (std::size_t i = 0; i < after.luminaires.size(); ++i) {
    EXPECT_EQ(edited.luminaires[i].name, after.luminaires[i].name);
    EXPECT_EQ(edited.luminaires[i].light_field, after.luminaires[i].light_field);
    EXPECT_EQ(edited.luminaires[i].tables, after.luminaires[i].tables);
    EXPECT_EQ(edited.luminaires[i].scale, after.luminaires[i].scale);
    EXPECT_EQ(edited.luminaires[i].world_from_luminaire.linear,
              after.luminaires[i].world_from_luminaire.linear);
  }
  ASSERT_EQ(edited.geometry.materials.size(), after.geometry.materials.size());
  for (std::size_t i = 0; i < after.geometry.materials.size(); ++i) {
    EXPECT_EQ(edited.geometry.materials[i].albedo, after.geometry.materials[i].albedo);
    EXPECT_EQ(edited.geometry.materials[i].roughness, after.geometry.materials[i].roughness);
  }
  EXPECT_EQ(edited.environment->scale, after.environment->scale);
  EXPECT_EQ(edited.environment->world_from_environment.linear,
            after.environment->world_from_environment.linear);
}

// A camera that is kept looks to where it did.
TEST(SavedView, IsTheCameraItWasKeptOf) {
  const scene::Camera camera =
      scene::Camera::LookAt({1.23456, -4, 2}, {0.5, 0.25, 0.5}, {0, 0, 1}, 33, 400, 300);
  const scene::Camera again = CameraOf(ViewFrom(camera, 0.5, "v"), camera);
  for (const auto axis : {&scene::Camera::forward, &scene::Camera::right, &scene::Camera::up})
    EXPECT_LT(lightfield::Length(again.*axis - camera.*axis), 3e-5);
  EXPECT_LT(lightfield::Length(again.position - camera.position), 1e-4);
  EXPECT_EQ(again.vertical_fov_deg, 33);
  const scene::Camera down =
      scene::Camera::LookAt({0, 0, 5}, {0, 0, 0}, {0.6, 0.8, 0}, 33, 400, 300);
  EXPECT_LT(lightfield::Length(CameraOf(ViewFrom(down, 1, "v"), down).up - down.up), 3e-4);
}

TEST_F(SceneEditsTest, ALampThatLooksAtItselfHasNoPose) {
  LampPlacement placement;
  placement.look_at = placement.position;
  EXPECT_FALSE(placement.WorldFromLuminaire());
  placement.look_at = lightfield::Vec3{0, 0, 5};  // along `up`
  EXPECT_FALSE(placement.WorldFromLuminaire());
  placement.look_at = lightfield::Vec3{0, 5, 5};
  EXPECT_TRUE(placement.WorldFromLuminaire());
}

}  // namespace
}  // namespace luxfield::view
