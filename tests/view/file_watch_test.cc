// Files that others write while they are looked at.
#include "luxfield/view/scene_file/file_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <thread>

#include "luxfield/view/lighting/load_scene.h"
#include "tests/e2e/program.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class FileWatchTest : public testing::Test {
 protected:
  FileWatchTest()
      : folder_(e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name())) {}
  ~FileWatchTest() override { fs::remove_all(folder_); }

  // With a time of its own, however fast the clock's steps are.
  fs::path Write(const std::string& name) {
    const fs::path file = folder_ / name;
    e2e::WriteText(file, "x");
    fs::last_write_time(file, fs::file_time_type::clock::now() + ++written_ * 10s);
    return file;
  }
  // Within three looks, of which a change needs two.
  bool Changes() {
    for (int i = 0; i < 40; ++i, std::this_thread::sleep_for(50ms))
      if (watch_.Changed()) return true;
    return false;
  }

  fs::path folder_;
  int written_ = 0;
  FileWatch watch_;
};

TEST_F(FileWatchTest, AFileChangesOnceItIsWritten) {
  watch_.Watch({Write("a"), Write("b")});
  EXPECT_FALSE(Changes());
  Write("b");
  EXPECT_TRUE(Changes());
  EXPECT_FALSE(Changes());
}

TEST_F(FileWatchTest, WhatIsAbsentKeepsNoOtherBack) {
  watch_.Watch({Write("a"), folder_ / "b"});
  Write("a");
  EXPECT_TRUE(Changes());
  fs::remove(folder_ / "a");
  EXPECT_FALSE(Changes());
  Write("b");
  EXPECT_TRUE(Changes());
  Write("a");
  EXPECT_TRUE(Changes());
}

// What changed while files were read is not forgotten; what was written here is.
TEST_F(FileWatchTest, KnownFilesAreAsTheyWere) {
  const fs::path a = Write("a"), b = Write("b");
  watch_.Watch({a});
  Write("a");
  watch_.Watch({a, b});
  EXPECT_TRUE(Changes());
  Write("a");
  watch_.Accept(a);
  EXPECT_FALSE(Changes());
}

TEST(FilesOf, AreAllThatTheSceneIsReadAndLitFrom) {
  const fs::path folder = e2e::FreshFolder("files_of_scene");
  e2e::WriteText(folder / "scene.toml",
                 "[[mesh]]\nfile = \"car.glb\"\n[[mesh]]\nfile = \"car.glb\"\n");
  scene::Scene scene;
  scene.file = folder / "scene.toml";
  scene.geometry.textures.emplace_back().name = "paint.png";
  scene.luminaires.resize(2);
  for (scene::Luminaire& lamp : scene.luminaires) lamp.light_field = "lamp.lf.exr";
  scene.classical_lights.emplace_back().distribution = "spot.ies";
  scene.environment.emplace().file = "sky.hdr";
  EXPECT_THAT(FilesOf(scene), testing::UnorderedElementsAre(
                                  scene.file, folder / "car.glb", "paint.png", "lamp.lf.exr",
                                  "lamp.sigma.lf.exr", "spot.ies", "sky.hdr"));
  // The reader says what is wrong with a file that is half written.
  e2e::WriteText(scene.file, "[[mesh]]\nfile = ");
  EXPECT_EQ(FilesOf(scene).size(), 6);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::view
