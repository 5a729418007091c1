// Certificates as `luxfield photometry` writes them, and what they say of the measurement's quality.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "luxfield/lightfield/posed_light_field.h"
#include "tests/e2e/pdf_text.h"
#include "tests/e2e/photometry_verb.h"

namespace luxfield::e2e {
namespace {

using lightfield::LightField;
using nlohmann::json;

class Certificate : public PhotometryVerb {};

TEST_F(Certificate, CertificatesSayWhatIsStatedAndWhatIsNot) {
  WriteText(folder_ / "ask.toml",
            std::string(kAskedOfALamp) +
                "[[glare]]\nbelow_m = 1.5\ndistances_m = [1, 2]\nbackground_cd_per_m2 = 40\n"
                "[certificate]\nlaboratory = \"Light & Co\"\nnumber = \"17\"\n");
  Ask(HillLamp(1e6), {"--ask", "ask.toml", "-o", "x.cert.json"});
  const json found = json::parse(ReadText(folder_ / "x.cert.json"));
  EXPECT_EQ(found["laboratory"]["laboratory"], "Light & Co");
  EXPECT_TRUE(found["laboratory"]["customer"].is_null());
  EXPECT_EQ(found["results"][0]["value"], found["photometry"]["flux_lm"]);
  EXPECT_TRUE(found["results"][0]["U"].is_null());
  const auto result = [&](const std::string& quantity) {
    for (const json& one : found["results"])
      if (one["quantity"] == quantity) return one["value"];
    return json();
  };
  const json& eye = found["photometry"]["eyes"][0];
  EXPECT_EQ(result("UGR of this lamp alone"), eye["ugr"]);
  EXPECT_EQ(result("Veiling luminance"), eye["veiling_luminance_cd_per_m2"]);
  EXPECT_EQ(result("Threshold increment"), eye["threshold_increment_percent"]);
  std::vector<double> ratings;
  const json each = found["photometry"]["glare"][0]["ugr"].flatten();
  for (const json& rating : each)
    if (rating.is_number()) ratings.push_back(rating);
  ASSERT_GT(ratings.size(), 1u);
  EXPECT_EQ(result("Largest UGR of this lamp alone"), *std::ranges::max_element(ratings));
  EXPECT_EQ(found["files"].size(), 2u);
  EXPECT_EQ(found["files"][0]["sha256"], found["photometry"]["sha256"]);
  EXPECT_TRUE(found["budget"].is_null());
  Ask(HillLamp(1e6), {"--ask", "ask.toml", "-o", "x.pdf"});
  EXPECT_THAT(ReadText(folder_ / "x.pdf"), testing::StartsWith("%PDF-"));
  for (const auto& [arguments, said] :
       {std::pair{std::vector<std::string>{"--uncertainty", "ask.toml", "-o", "y.html"},
                  "certificate"},
        {{"--uncertainty", "ask.toml", "-o", "y.pdf"}, "--session"}}) {
    std::vector<std::string> all{"photometry", "x.lf.exr"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome refused = RunLuxfield(all, folder_);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, testing::HasSubstr(said));
  }
}

// A condition that is longer than a page, and a name that is wider than its column.
TEST_F(Certificate, LongTextsAreThereWhole) {
  if (!HasPdfReader()) GTEST_SKIP() << "pdftotext (poppler-utils) is missing";
  std::string condition, sentences, name;
  for (int k = 0; k < 320; ++k) sentences += fmt::format("Sentence{:03}.", k);
  for (int k = 0; k < 320; ++k) condition += fmt::format("Sentence {:03}. ", k);
  for (int k = 0; k < 70; ++k) name += fmt::format("p{:03}.", k);
  WriteText(folder_ / "ask.toml", "[certificate]\ncondition = \"" + condition +
                                      "\"\n[[point]]\nname = \"" + name +
                                      "\"\nposition_m = [0.1, 0, 2]\n");
  Ask(HillLamp(1e6), {"--ask", "ask.toml", "-o", "x.pdf"});
  // A page ends within the row.
  const std::string text = std::regex_replace(
      LettersOf(folder_ / "x.pdf"),
      std::regex("page[0-9]+of[0-9]+Certificate[^;]*;lightfieldSHA-256[0-9a-f]*\\."
                 "|statedbythelaboratory|\\(continued\\)"),
      "");
  EXPECT_THAT(text, testing::HasSubstr(sentences));
  EXPECT_THAT(text, testing::HasSubstr(name));
}

TEST_F(Certificate, QualityFollowsFromFiles) {
  // Infrared light that the camera sees and the eye does not, beside green light.
  WriteText(folder_ / "camera.csv", "nm,relative\n500,1\n900,1\n");
  WriteText(folder_ / "lamp.csv", "549,0\n550,1\n551,0\n");
  WriteText(folder_ / "source.csv", "549,0\n550,1\n551,0\n799,0\n800,1\n801,0\n");
  WriteText(folder_ / "sensor.cal.json",
            R"({"format": "luxfield sensor calibration", "channels": [
                {"linearity": {"largest_deviation": -0.004, "repeatability": 0.001}, "prnu": 0.01},
                {"linearity": {"largest_deviation": 0.003, "repeatability": 0.002}}]})");
  WriteText(folder_ / "ask.toml",
            "[quality]\nresponsivity = \"camera.csv\"\nlamp_spectrum = \"lamp.csv\"\n"
            "calibration_spectrum = \"source.csv\"\nsensor_calibration = \"sensor.cal.json\"\n"
            "[[eye]]\neye_m = [0, 0, 1]\nline_of_sight = [-1, 0, -1]\nbackground_cd_per_m2 = 40\n");
  const LightField lamp = HillLamp(1e6);
  lightfield::WriteLightField(folder_ / "s.lf.exr", [&] {
    LightField sigma = lamp;
    for (float& c : sigma.data) c *= 0.01f;
    sigma.provenance["solve"] = "none";
    return sigma;
  }());
  const json found =
      Ask(lamp, {"--ask", "ask.toml", "--sigma", "s.lf.exr", "-o", "x.cert.json"})["quality"];
  EXPECT_NEAR(found["spectral_mismatch_factor"].get<double>(), 2, 1e-6);
  EXPECT_NEAR(found["spectral_mismatch_u_relative"].get<double>(), 1 / std::sqrt(3.0), 1e-6);
  EXPECT_GT(found["f1"].get<double>(), 1);
  EXPECT_EQ(found["f3"], 0.004);
  EXPECT_EQ(found["repeatability"], 0.002);
  EXPECT_EQ(found["prnu"], 0.01);
  EXPECT_GT(found["beyond_planes_bound_flux_lm"].get<double>(), 0);
  EXPECT_FALSE(found["not_known"].contains("f1"));
  EXPECT_TRUE(found["not_known"].contains("f2"));
  const json certificate = json::parse(ReadText(folder_ / "x.cert.json"));
  EXPECT_EQ(certificate["files"].size(), 7u);
  const json& flux = certificate["results"][0];
  const double value = flux["value"], noise = flux["u_noise"];
  EXPECT_NEAR(flux["U"].get<double>(), 2 * std::hypot(noise, value / std::sqrt(3.0)), 1e-6 * value);
  const auto& results = certificate["results"];
  const auto ugr = std::find_if(results.begin(), results.end(), [](const json& one) {
    return one["quantity"] == "UGR of this lamp alone";
  });
  ASSERT_NE(ugr, results.end());
  // 8 log10 of luminance squared.
  EXPECT_NEAR((*ugr)["U"].get<double>(),
              2 * std::hypot((*ugr)["u_noise"].get<double>(), 16 / std::log(10) / std::sqrt(3.0)),
              1e-9);
  EXPECT_THAT(certificate["coverage"]["text"].get<std::string>(),
              testing::HasSubstr("spectral mismatch"));
  Run({"photometry", "x.lf.exr", "--ask", "ask.toml", "-o", "x.pdf"});
  EXPECT_THAT(Page({"--ask", "ask.toml"}),
              testing::AllOf(testing::HasSubstr("directional response, f2; surrounding field"),
                             testing::HasSubstr("range change (ranges are exposure times")));
  EXPECT_TRUE(Ask(lamp)["quality"]["f1"].is_null());
  WriteText(folder_ / "lamp.csv", "1200,1\n1300,1\n");
  const Outcome dark = RunLuxfield({"photometry", "x.lf.exr", "--ask", "ask.toml"}, folder_);
  EXPECT_EQ(dark.exit_code, 2);
  EXPECT_THAT(dark.err, testing::AllOf(testing::HasSubstr("lamp.csv"),
                                       testing::HasSubstr("has no light that camera and eye")));
}

}  // namespace
}  // namespace luxfield::e2e
