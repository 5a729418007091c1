// Files that a verb writes beside its output: all are told, none has a name that another format's
// could have, and what is no such file is not replaced.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "luxfield/lightfield/posed_light_field.h"
#include "tests/e2e/verb_test.h"
#include "tests/formats/light_field_lamps.h"

namespace luxfield::e2e {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Words = std::vector<std::string>;
using testing::HasSubstr;

class BelongingFiles : public VerbTest {
 protected:
  void SetUp() override {
    VerbTest::SetUp();
    lightfield::WriteLightFields(folder_ / "x.lf.exr", formats::AsymmetricLamp(3));
  }

  // Every file but that of --json, by its name in the folder.
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file() && entry.path().filename() != "figures.json")
        files[fs::relative(entry.path(), folder_).string()] = ReadText(entry.path());
    return files;
  }

  // A text of the user's in place of the file: it is named, and everything is left as it is.
  void ExpectKept(const Words& words, const std::string& file) {
    SCOPED_TRACE(file);
    const std::string own = ReadText(folder_ / file);
    WriteText(folder_ / file, "a user's own text");
    const auto before = Files();
    const Outcome outcome = RunLuxfield(words, folder_);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("luxfield: " + file + ": is "));
    EXPECT_THAT(outcome.err, HasSubstr("; move it away, or name another output"));
    EXPECT_EQ(Files(), before);
    WriteText(folder_ / file, own);
  }
};

TEST_F(BelongingFiles, ExportsMeetNoOtherFormats) {
  for (const Words& other : std::vector<Words>{{"x.dat", "--rays", "500"},
                                               {"x.ies"},
                                               {"x.exr", "--size", "9", "7", "--samples", "1"}}) {
    Words words = {"export", "x.lf.exr", "-o"};
    words.insert(words.end(), other.begin(), other.end());
    Run(words);
  }
  for (const char* name : {"x.cal", "x_r.dat", "x_0.exr", "x_far.pbrt", "x_far.exr"})
    WriteText(folder_ / name, "a user's own text");
  fs::create_directory(folder_ / "x");
  WriteText(folder_ / "x/00.00.exr", "of a session");

  for (const auto& [output, program] :
       {std::pair{"x.rad", "radiance"}, std::pair{"x.json", "blender"},
        std::pair{"x.xml", "mitsuba"}, std::pair{"x.usda", "usd"}, std::pair{"x.pbrt", "pbrt"}}) {
    SCOPED_TRACE(output);
    const Words words = {"export", "x.lf.exr", "-o", output, "--to", program};
    const auto before = Files();
    const auto told = Run(words).at("files").get<std::vector<std::string>>();
    auto files = Files();
    ASSERT_GE(told.size(), 2u);
    EXPECT_EQ(told.front(), output);
    for (const std::string& file : told) {
      EXPECT_THAT(file, testing::StartsWith(output));
      EXPECT_EQ(files.erase(file), 1u) << file;
    }
    EXPECT_EQ(files, before);

    Run(words);  // which replaces its own
    ExpectKept(words, told[1]);
    ExpectKept(words, told.back());
  }
}

TEST_F(BelongingFiles, SheetsOfAFilter) {
  const Words words = {"filter", "print", "-o", "f", "--spacing", "20mm", "--dpi", "60"};
  const auto told = Run(words).at("files").get<std::vector<std::string>>();
  EXPECT_THAT(told, testing::ElementsAre("f.sheet.json", "f.tif", "f.pdf"));
  Run(words);
  for (const std::string& file : told) ExpectKept(words, file);
}

TEST_F(BelongingFiles, AReductionReplacesNoLightField) {
  WriteText(folder_ / "scene.toml", R"([camera]
position = [0, -3, 1.5]
look_at = [0, 3, 0]
width = 16
height = 12
[[material]]
name = "floor"
albedo = [0.6, 0.5, 0.4]
[[quad]]
corner = [-5, -5, 0]
edge_u = [10, 0, 0]
edge_v = [0, 10, 0]
material = "floor"
[[luminaire]]
name = "lamp"
file = "x.lf.exr"
position = [0, 0, 1]
look_at = [0, 3, 0.2]
)");
  const Words words = {"preprocess", "x.lf.exr",   "-o",          "y.tab.exr",
                       "--scene",    "scene.toml", "--receivers", "20"};
  fs::copy_file(folder_ / "x.lf.exr", folder_ / "y.lf.exr");  // a measured one
  const auto before = Files();
  const Outcome refused = RunLuxfield(words, folder_);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("y.lf.exr: is a light field (.lf.exr), in whose place a file "
                                     "that belongs to y.tab.exr would come; move it away"));
  EXPECT_EQ(Files(), before);
  fs::remove(folder_ / "y.lf.exr");
  EXPECT_EQ(Run(words).at("reduction").at("file"), "y.lf.exr");
  Run(words);  // which replaces its own
}

TEST_F(BelongingFiles, APlanReplacesNoLabAndNoDrawing) {
  const Words words = {"plan",         SourceFile("data/plans/small.toml").string(),
                       "--lab",        SourceFile("data/labs/small.toml").string(),
                       "--scene",      SourceFile("data/scenes/demo.toml").string(),
                       "--texels",     "24",
                       "--receivers",  "40",
                       "--max-error",  "60%",
                       "--no-capture", "-o",
                       "p.toml",       "--report",
                       "p.html"};
  const auto told = Run(words).at("files").get<std::vector<std::string>>();
  EXPECT_THAT(told, testing::UnorderedElementsAre("p.toml", "p.lab.toml", "p.html", "p.svg"));
  Run(words);  // which replaces its own
  ExpectKept(words, "p.lab.toml");
  ExpectKept(words, "p.svg");
}

}  // namespace
}  // namespace luxfield::e2e
