// The page of a lamp: what it holds, what JavaScript decodes of it (node), and what a browser shows
// and reads (headless Chromium). Both are skipped, loudly, where the program is missing.
#include "luxfield/web/lamp_page.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "tests/seed.h"
#include "tests/web/browser.h"
#include "tests/web/lamp.h"

namespace luxfield::web {
namespace {

using lightfield::LightField;

// A page of the small lamp, and receivers with the exact illuminance and that of the volume.
struct Sample {
  std::filesystem::path folder, page, receivers;
  FittedVolume fitted;
  std::string text;
};

std::vector<preprocess::Receiver> ReceiversOf(const LightField& field, const FittedVolume& fitted,
                                              std::uint64_t seed) {
  std::vector<preprocess::Receiver> receivers;
  for (const ErrorZone& zone : fitted.zones) {
    const auto some = LitReceivers(field, fitted.volume, zone.z_first_m, zone.z_last_m, 200,
                                   seed + receivers.size());
    receivers.insert(receivers.end(), some.begin(), some.end());
  }
  return receivers;
}

Sample MakeSample(int channels) {
  Sample sample;
  sample.folder =
      std::filesystem::path(testing::TempDir()) / fmt::format("web_{}_{}", ::getpid(), channels);
  std::filesystem::create_directories(sample.folder);
  sample.page = sample.folder / "lamp.html";
  sample.receivers = sample.folder / "receivers.json";
  const LightField field = SmallLamp(channels);
  FitOptions options;
  options.max_bytes = 40000;
  options.max_error = 0.02;
  options.receivers = 200;
  sample.fitted =
      WriteLampPage(sample.page, field, {"A <lamp> & more", "lamp.lf.exr", ""}, options).fitted;
  sample.text = core::ReadFile(sample.page);
  core::Json list = core::Json::array();
  for (const auto& [p, n] : ReceiversOf(field, sample.fitted, TestSeed(11)))
    list.push_back({{"p", {p.x, p.y, p.z}},
                    {"n", {n.x, n.y, n.z}},
                    {"exact", core::Luminance(lightfield::ExactIrradiance(field, p, n))},
                    {"volume", IlluminanceAt(sample.fitted.volume, p, n)},
                    {"brightest", BrightestAt(sample.fitted.volume, p.z)}});
  std::ofstream(sample.receivers) << list.dump();
  return sample;
}

const Sample& OneChannel() {
  static const Sample sample = MakeSample(1);
  return sample;
}

// Titles and names of files may hold what turns the direction of writing.
TEST(LampPage, NamesAreShownAndNotObeyed) {
  const std::string page =
      LampPage(SmallLamp(1), OneChannel().fitted, {"a\u202eb\x1b", "c\u2066\xff.lf.exr", ""});
  EXPECT_NE(page.find("<title>a\\xe2\\x80\\xaeb\\x1b</title>"), page.npos);
  EXPECT_NE(page.find(" of c\\xe2\\x81\\xa6\\xff.lf.exr"), page.npos);
  EXPECT_EQ(page.find("\u202e"), page.npos);
  EXPECT_EQ(page.find("\u2066"), page.npos);
}

TEST(LampPage, IsOneFileThatAsksForNothing) {
  const Sample& sample = OneChannel();
  EXPECT_LT(sample.text.size(), 40000 * 4 / 3 + 100000);
  EXPECT_EQ(sample.text.find("http://"), sample.text.npos);
  EXPECT_EQ(sample.text.find("https://"), sample.text.npos);
  EXPECT_EQ(sample.text.find(" src="), sample.text.npos);
  EXPECT_NE(sample.text.find("default-src 'none'"), sample.text.npos);
  EXPECT_NE(sample.text.find("<title>A &lt;lamp&gt; &amp; more</title>"), sample.text.npos);
  for (const char* place : {"@TITLE@", "@LAMP@", "@SCRIPT@", "@ZONES@", "@ERROR@", "@STYLE@"})
    EXPECT_EQ(sample.text.find(place), sample.text.npos) << place;
}

// The JSON holds the volume whole: decoded anew it is the one that was fitted.
TEST(LampPage, HoldsTheVolume) {
  const Sample& sample = OneChannel();
  const core::Json json = core::ParseJson(PageJson(sample.fitted), "page");
  EXPECT_EQ(json["unit"], "lx");
  EXPECT_EQ(json["stated_error"].get<double>(), sample.fitted.stated_error());
  ASSERT_EQ(json["tables"].size(), sample.fitted.volume.tables.size());
  EXPECT_NE(sample.text.find(json["tables"][0]["codes"].get<std::string>()), sample.text.npos);
  const FittedVolume read = ReadLampPage(sample.page);
  ASSERT_EQ(read.volume.tables.size(), sample.fitted.volume.tables.size());
  for (std::size_t k = 0; k < read.volume.tables.size(); ++k)
    EXPECT_EQ(read.volume.tables[k].coefficients, sample.fitted.volume.tables[k].coefficients);
  EXPECT_EQ(read.stated_error(), sample.fitted.stated_error());
  EXPECT_EQ(IlluminanceAt(read.volume, {0.01, 0.02, 0.7}, {0, 0, -1}),
            IlluminanceAt(sample.fitted.volume, {0.01, 0.02, 0.7}, {0, 0, -1}));
  FittedVolume fitted = sample.fitted;
  fitted.volume.unit = lightfield::FluxUnit::kWatt;
  EXPECT_EQ(core::ParseJson(PageJson(fitted), "page")["unit"], "W/m\u00b2");
}

TEST(LampPage, NamesAPageThatIsDamaged) {
  const Sample& sample = OneChannel();
  const auto damaged = sample.folder / "damaged.html";
  const auto said = [&](const std::string& text) -> std::string {
    std::ofstream(damaged) << text;
    try {
      ReadLampPage(damaged);
    } catch (const InputError& error) {
      return error.what();
    }
    return "read";
  };
  std::string text = sample.text;
  EXPECT_NE(said("no page").find("damaged.html: holds no whole lamp"), std::string::npos);
  EXPECT_NE(said(text.substr(0, text.size() / 4)).find("damaged.html: holds"), std::string::npos);
  const auto codes = text.find("\"codes\":\"") + 9;
  EXPECT_NE(said(text.replace(codes, 400, 400, 'A')).find("damaged.html: holds"),
            std::string::npos);
}

// JavaScript reads the coefficients as C++ does: float32 of the same sinh, and sums of 64 of them.
TEST(LampPage, NodeReadsAsTheProgram) {
  LUXFIELD_NEEDS_PROGRAM("node");
  for (const int channels : {1, 3}) {
    const Sample sample = channels == 1 ? OneChannel() : MakeSample(channels);
    const std::string said =
        OutputOf(fmt::format("node {}/tests/web/read_page.js {} {} 2>&1", LUXFIELD_SOURCE_DIR,
                             sample.page.string(), sample.receivers.string()));
    ASSERT_EQ(said.substr(0, 1), "{") << said;
    const core::Json result = core::ParseJson(said, "node");
    std::printf("%d channels: %s\n", channels, said.c_str());
    EXPECT_EQ(result["receivers"].get<int>(), 1000);
    EXPECT_LT(result["from_program"].get<double>(), 1e-6);
    EXPECT_LT(result["brightest"].get<double>(), 1e-6);
    EXPECT_LE(result["of_stated"].get<double>(), 1);
  }
}

TEST(LampPage, ChromiumHasNothingToSay) {
  LUXFIELD_NEEDS_PROGRAM("chromium");
  const Shown shown = ShowInChromium(OneChannel().page);
  EXPECT_EQ(shown.log.find("CONSOLE"), shown.log.npos) << shown.log;
  // Its sliders are set, and no message says that there is no picture.
  EXPECT_NE(shown.document.find("3.00 m"), shown.document.npos);
  EXPECT_NE(shown.document.find("id=\"message\" hidden"), shown.document.npos);
}

// A copy of the page with a script more, which asks window.luxfield and writes what it says.
TEST(LampPage, ChromiumReadsWithinTheStatedError) {
  LUXFIELD_NEEDS_PROGRAM("chromium");
  const Sample& sample = OneChannel();
  const std::string receivers = core::ReadFile(sample.receivers),
                    asks = core::ReadFile(std::filesystem::path(LUXFIELD_SOURCE_DIR) /
                                          "tests/web/ask_page.js");
  const std::string said =
      SaidByPage(sample.text, fmt::format("const RECEIVERS = {};\n{}", receivers, asks),
                 sample.folder / "asked.html");
  ASSERT_EQ(said.substr(0, 1), "{") << said;
  std::printf("%s\n", said.c_str());
  const core::Json result = core::ParseJson(said, "chromium");
  EXPECT_EQ(result["receivers"].get<int>(), 1000);
  EXPECT_LE(result["of_stated"].get<double>(), 1);
  EXPECT_EQ(result["requests"].get<int>(), 0);
  EXPECT_EQ(result["errors"].get<int>(), 0);
  // Tables and filter are of float32 there: 64 terms of 24 bits.
  ASSERT_FALSE(result["shader"].is_null());
  EXPECT_LT(result["shader"].get<double>(), 1e-4);
}

}  // namespace
}  // namespace luxfield::web
