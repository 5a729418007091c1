// Every complaint about a configuration names the file and the field.
#include "luxfield/core/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"

namespace luxfield::core {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kText = R"(
title = "lab"
[camera]
gain = 2.5
bits = 12
cooled = true
offset = [1, 2.5]
mode = "fast"
[[lamp]]
power = 3
[[lamp]]
power = -1
)";

std::string ErrorOf(const std::function<void(const Config&)>& use,
                    const std::string& text = kText) {
  try {
    use(Config::FromString(text, "dir/lab.toml"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Config, ReadsEveryType) {
  const Config config = Config::FromString(kText, "dir/lab.toml");
  EXPECT_EQ(config.Text("title"), "lab");
  EXPECT_EQ(config.Path("title"), std::filesystem::path("dir/lab"));
  const Config camera = config.Table("camera");
  EXPECT_EQ(camera.Number("gain"), 2.5);
  EXPECT_EQ(camera.Number("bits"), 12);
  EXPECT_EQ(camera.Integer("bits", 8, 16), 12);
  EXPECT_TRUE(camera.Boolean("cooled", false));
  EXPECT_EQ(camera.Numbers("offset", 2), (std::vector<double>{1, 2.5}));
  EXPECT_EQ(camera.Choice("mode", {"slow", "fast"}), "fast");
  const auto lamps = config.Tables("lamp");
  ASSERT_EQ(lamps.size(), 2u);
  EXPECT_EQ(lamps[0].Number("power"), 3);
  EXPECT_EQ(lamps[1].Number("power"), -1);
  EXPECT_NO_THROW(config.Finish());
}

TEST(Config, FallbacksServeAbsentKeysOnly) {
  const Config config = Config::FromString(kText, "lab.toml");
  const Config camera = config.Table("camera");
  EXPECT_EQ(camera.Number("absent", 7, {}), 7);
  EXPECT_EQ(camera.Integer("absent", 7, 0, 10), 7);
  EXPECT_EQ(camera.Text("absent", "x"), "x");
  EXPECT_EQ(camera.Choice("absent", {"a", "b"}, "b"), "b");
  EXPECT_EQ(camera.Numbers("absent", 1, {4}), (std::vector<double>{4}));
  EXPECT_FALSE(config.OptionalTable("absent").has_value());
  EXPECT_TRUE(config.Tables("absent").empty());
  EXPECT_THROW(camera.Number("gain", 1, {0, 2}), InputError);  // present, so it must be right
}

TEST(Config, ErrorsNameFileFieldAndValue) {
  const auto camera = [](auto&& use) {
    return ErrorOf([&](const Config& config) { use(config.Table("camera")); });
  };
  EXPECT_THAT(camera([](const Config& c) { c.Number("absent"); }),
              AllOf(HasSubstr("dir/lab.toml"), HasSubstr("camera.absent"), HasSubstr("missing")));
  EXPECT_THAT(camera([](const Config& c) {
                c.Number("gain", {0, 2});
              }),
              AllOf(HasSubstr("camera.gain = 2.5"), HasSubstr("[0, 2]")));
  EXPECT_THAT(camera([](const Config& c) { c.Number("mode"); }), HasSubstr("camera.mode"));
  EXPECT_THAT(camera([](const Config& c) { c.Integer("gain", 0, 9); }), HasSubstr("whole number"));
  EXPECT_THAT(camera([](const Config& c) { c.Integer("bits", 14, 16); }),
              HasSubstr("camera.bits = 12"));
  EXPECT_THAT(camera([](const Config& c) { c.Boolean("bits", true); }), HasSubstr("true or false"));
  EXPECT_THAT(camera([](const Config& c) { c.Text("bits"); }), HasSubstr("text"));
  EXPECT_THAT(camera([](const Config& c) {
                c.Choice("mode", {"a", "b"});
              }),
              AllOf(HasSubstr("camera.mode"), HasSubstr("a, b")));
  EXPECT_THAT(camera([](const Config& c) { c.Numbers("offset", 3); }), HasSubstr("3 belong"));
  EXPECT_THAT(camera([](const Config& c) { c.Numbers("gain", 1); }), HasSubstr("camera.gain"));
  EXPECT_THAT(camera([](const Config& c) { c.Table("gain"); }), HasSubstr("[camera.gain]"));
  EXPECT_THAT(camera([](const Config& c) { c.Tables("offset"); }), HasSubstr("[[camera.offset]]"));
  EXPECT_THAT(ErrorOf([](const Config& c) {
                c.Tables("lamp")[1].Number("power", {0, 9});
              }),
              HasSubstr("lamp[1].power = -1"));
}

TEST(Config, MisspeltKeysAreFoundWhereverTheyAre) {
  EXPECT_THAT(ErrorOf([](const Config& c) { c.Finish(); }), HasSubstr("is not a known key"));
  EXPECT_THAT(ErrorOf([](const Config& c) {
                c.Text("title");
                c.Tables("lamp")[0].Number("power");
                const Config camera = c.Table("camera");
                camera.Number("gian", 1, {});
                for (const char* key : {"bits", "cooled", "offset", "mode"}) camera.Has(key);
                for (const Config& lamp : c.Tables("lamp")) lamp.Number("power");
                c.Finish();
              }),
              AllOf(HasSubstr("camera.gain"), HasSubstr("gian")));
}

TEST(Config, NumbersThatAreNone) {
  for (const char* value : {"nan", "inf", "-inf"}) {
    const std::string text = std::string("x = ") + value + "\ny = [1, " + value + "]";
    EXPECT_THAT(ErrorOf([](const Config& c) { c.Number("x"); }, text), HasSubstr("x"));
    EXPECT_THAT(ErrorOf([](const Config& c) { c.Numbers("y", 2); }, text), HasSubstr("finite"));
  }
  // Beyond what a double holds exactly, and beyond an int.
  EXPECT_NEAR(Config::FromString("x = 9007199254740993", "f").Number("x"), 9007199254740993.0, 2);
  EXPECT_EQ(Config::FromString("x = [9007199254740993]", "f").Numbers("x", 1).size(), 1u);
  EXPECT_THAT(ErrorOf([](const Config& c) { c.Integer("x", 0, 10); }, "x = 9223372036854775807"),
              HasSubstr("[0, 10]"));
}

TEST(Config, BrokenTextNamesFileAndLine) {
  for (const char* text : {"a = ", "a = 1\nb = [1,", "[a", "a = 1\na = 2", "\xff\xfe", "a = \"\n"})
    EXPECT_THAT(ErrorOf([](const Config&) {}, text),
                AllOf(HasSubstr("dir/lab.toml"), HasSubstr("line")))
        << text;
  const std::string deep = "a = " + std::string(100000, '[') + std::string(100000, ']');
  EXPECT_THAT(ErrorOf([](const Config&) {}, deep), HasSubstr("dir/lab.toml"));
  EXPECT_THROW(Config::FromFile("/nonexistent/lab.toml"), InputError);
  EXPECT_THROW(Config::FromFile(testing::TempDir()), InputError);
}

TEST(Config, FailNamesTheValue) {
  EXPECT_THAT(
      ErrorOf([](const Config& c) { c.Table("camera").Fail("gain", "is odd", "halve it"); }),
      testing::StrEq("dir/lab.toml: camera.gain = 2.5 is odd; halve it"));
}

TEST(JsonFile, ErrorsNameFileAndField) {
  const Json json = ParseJson(R"({"a": 1, "b": "x"})", "s.json");
  EXPECT_EQ(Field<int>(json, "a", "s.json"), 1);
  const auto error = [](auto&& use) -> std::string {
    try {
      use();
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(error([&] { Field<int>(json, "c", "s.json"); }),
              AllOf(HasSubstr("s.json"), HasSubstr("'c' is missing")));
  EXPECT_THAT(error([&] { Field<int>(json, "b", "s.json"); }), HasSubstr("'b' = \"x\""));
  EXPECT_THAT(error([&] { Field<int>(Json(3), "b", "s.json"); }), HasSubstr("'b'"));
  for (const char* text : {"", "{", "[1,", "nul", "\xff", "{\"a\":1}}"})
    EXPECT_THAT(error([&] { ParseJson(text, "s.json"); }), HasSubstr("s.json")) << text;
}

}  // namespace
}  // namespace luxfield::core
