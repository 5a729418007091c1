// `luxfield photometry` as a user runs it: what it writes of lamps that are whole, dark, negative or
// of one image, with sigma and without.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "luxfield/lightfield/measurements.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "tests/e2e/photometry_verb.h"

namespace luxfield::e2e {
namespace {

using lightfield::LightField;
using nlohmann::json;

class Photometry : public PhotometryVerb {};

TEST_F(Photometry, HasTheKeysOfThePage) {
  WriteText(folder_ / "ask.toml", kAskedOfALamp);
  const LightField lamp = HillLamp(1e6);
  const json found =
      Ask(lamp, {"--ask", "ask.toml", "-o", "x.json", "--c-step", "90", "--gamma-step", "10"});
  EXPECT_NEAR(found["flux_lm"].get<double>(), lightfield::TotalFlux(lamp)[0],
              1e-6 * lightfield::TotalFlux(lamp)[0]);
  const double axis = lightfield::FarFieldIntensity(lamp, {0, 0, 1})[0];
  EXPECT_NEAR(found["intensity_axis_cd"].get<double>(), axis, 1e-6 * axis);
  EXPECT_GE(found["intensity_peak_cd"].get<double>(), axis);
  EXPECT_GT(found["field_angle_deg"].get<double>(), found["beam_angle_deg"].get<double>());
  for (const char* percent : {"1", "5", "10"}) {
    EXPECT_GT(found["inverse_square_distance_m"][percent].get<double>(), 0) << percent;
    EXPECT_TRUE(found["inverse_square_distance_m_u"][percent].is_null()) << percent;
  }
  for (const char* key :
       {"flux_lm_u", "intensity_axis_cd_u", "intensity_peak_cd_u", "beam_angle_deg_u",
        "field_angle_deg_u", "downward_share_u", "asymmetry_c0_c180_u", "peak_c_deg_u",
        "peak_gamma_deg_u", "peak_turn_deg_u", "covered_gamma_deg_u"})
    EXPECT_TRUE(found.at(key).is_null()) << key;
  EXPECT_EQ(found["intensity"]["c_deg"], json({0.0, 90.0, 180.0, 270.0}));
  EXPECT_EQ(found["intensity"]["gamma_deg"].size(), 10u);
  EXPECT_EQ(found["intensity"]["cd"].size(), 4u);
  EXPECT_EQ(found["points"][0]["name"], "desk & <chair>");
  EXPECT_GT(found["points"][0]["illuminance_semicylindrical_lx"].get<double>(), 0);
  const json& eye = found["eyes"][0];
  EXPECT_EQ(eye["fields_of_view"].size(), 3u);
  EXPECT_GT(eye["fields_of_view"][0]["luminance_largest_mean_cd_per_m2"].get<double>(),
            eye["fields_of_view"][2]["luminance_largest_mean_cd_per_m2"].get<double>());
  EXPECT_TRUE(eye["ugr"].is_number());
  // Of all of the lamp, from 1.53 m at cos = 1.5 / 1.53.
  EXPECT_NEAR(eye["luminous_area_m2"].get<double>(),
              eye["luminous_solid_angle_sr"].get<double>() * (0.09 + 2.25),
              0.01 * eye["luminous_area_m2"].get<double>());
  EXPECT_GT(eye["veiling_luminance_cd_per_m2"].get<double>(), 0);
  EXPECT_NEAR(eye["threshold_increment_percent"].get<double>(),
              65 * eye["veiling_luminance_cd_per_m2"].get<double>(), 1e-6);
  EXPECT_TRUE(found["colour"].is_null());
  EXPECT_EQ(found["planes"][0]["illuminance_lx"].size(), 5u);
  EXPECT_EQ(found["planes"][0]["illuminance_lx"][0].size(), 9u);
  const json written = json::parse(ReadText(folder_ / "x.json"));
  EXPECT_EQ(written["flux_lm"], found["flux_lm"]);
  const std::string page = Page({"--ask", "ask.toml"});
  EXPECT_THAT(page, testing::HasSubstr("desk &amp; &lt;chair&gt;"));
  EXPECT_THAT(page, testing::HasSubstr("Luminous intensity"));
  Ask(lamp, {"--ask", "ask.toml", "-o", "x.csv"});
  const std::string csv = ReadText(folder_ / "x.csv");
  EXPECT_THAT(csv, testing::StartsWith("quantity,where,value,u,unit\nflux,,"));
  EXPECT_THAT(csv, testing::HasSubstr("illuminance,wall; x = "));
}

TEST_F(Photometry, OfAReconstructionHasUncertainties) {
  lightfield::Measurements measurements;
  measurements.geometry = LampGeometry();
  const auto& g = measurements.geometry;
  for (int m = 0; m < g.grid.count(); ++m) {
    auto& position = measurements.positions.emplace_back();
    // The outer filters are dark, so that the solve keeps both moments.
    constexpr double kAlongU[] = {0.1, 10, 100, 10, 0.1}, kAlongV[] = {0.01, 1, 1, 0.01};
    for (std::size_t p = 0; p < g.plane_size(); ++p) {
      const auto s = g.lattice.centre(int(p) / g.lattice.width, int(p) % g.lattice.width);
      position.irradiance.push_back(static_cast<float>(kAlongU[m % 5] * kAlongV[m / 5] *
                                                       std::exp(-50 * (s.x * s.x + s.y * s.y))));
      position.sigma.push_back(0.5f);
    }
    position.count.assign(g.plane_size(), 1);
    position.mask.assign(g.plane_size(), 0);
  }
  lightfield::WriteMeasurements(folder_ / "x.meas.exr", measurements);
  Run({"reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--sigma", "x.sigma.lf.exr"});
  const json found = Run({"photometry", "x.lf.exr", "--sigma", "x.sigma.lf.exr"});
  // The moments are kept, so that the flux is the sum of all E, each with its own noise.
  const double u =
      0.5 * g.lattice.texel_area_m2() * std::sqrt(double(g.plane_size()) * g.grid.count());
  EXPECT_NEAR(found["flux_lm_u"].get<double>(), u, 1e-3 * u);
  for (const char* key :
       {"intensity_axis_cd_u", "intensity_peak_cd_u", "beam_angle_deg_u", "field_angle_deg_u"})
    EXPECT_GT(found.at(key).get<double>(), 0) << key;
  EXPECT_GT(found["inverse_square_distance_m_u"]["5"].get<double>(), 0);
  EXPECT_EQ(found["peak_turn_deg_u"].size(), 2u);
  EXPECT_EQ(found["covered_gamma_deg_u"], 0.0);
  EXPECT_GT(found["eyes"][0]["luminous_area_m2_u"].get<double>(), 0);
  EXPECT_THAT(Page({"--sigma", "x.sigma.lf.exr"}), testing::HasSubstr("u (k = 1)"));
  // Without a word of how it was solved.
  LightField sigma = lightfield::ReadLightField(folder_ / "x.sigma.lf.exr");
  sigma.provenance.erase("solve");
  lightfield::WriteLightField(folder_ / "old.sigma.lf.exr", sigma);
  const json old = Run({"photometry", "x.lf.exr", "--sigma", "old.sigma.lf.exr"});
  EXPECT_GT(old["flux_lm_u"].get<double>(), 3 * u);
  EXPECT_THAT(old["uncertainty"].get<std::string>(), testing::HasSubstr("independent"));
  // One of another lamp, and one that is regularised.
  lightfield::WriteLightField(folder_ / "other.lf.exr", LightField([] {
                                auto other = LampGeometry();
                                other.delta_m = 0.4;
                                return other;
                              }()));
  sigma.provenance["solve"] = "regularised";
  lightfield::WriteLightField(folder_ / "smooth.lf.exr", sigma);
  for (const char* wrong : {"other.lf.exr", "smooth.lf.exr"}) {
    const Outcome refused =
        RunLuxfield({"photometry", "x.lf.exr", "--sigma", wrong, "-o", "y.html"}, folder_);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, testing::HasSubstr(wrong));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "y.html"));
  }
}

TEST_F(Photometry, ExtremeLampsGiveSensiblePages) {
  WriteText(folder_ / "ask.toml",
            std::string(kAskedOfALamp) +
                "[[glare]]\nbelow_m = 1.5\ndistances_m = [1, 2]\nbackground_cd_per_m2 = 40\n"
                "opening_m = [0.1, 0.1]\n[[headlamp]]\nregulation = \"own.toml\"\n");
  std::filesystem::copy(SourceFile("data/regulations/un-r149-01-passing-c.toml"),
                        folder_ / "own.toml");
  lightfield::LuminaireGeometry one = LampGeometry();
  one.grid = lightfield::BasisGrid::Centred(one.grid.basis, 1, 1, 0.02);
  one.lattice = {1, 1, -0.01, 0.01, 0.02, 0.02};
  LightField single(one);
  single.data = {1e6f};
  for (const LightField& lamp : {HillLamp(0), HillLamp(-1e6), single}) {
    const json found = Ask(lamp);
    const bool lit = found["flux_lm"].get<double>() > 0;
    EXPECT_EQ(found["beam_angle_deg"].is_null(), !lit);
    EXPECT_EQ(found["inverse_square_distance_m"]["1"].is_null(), !lit);
    const std::string page = Page({"--ask", "ask.toml"});
    EXPECT_EQ(page.find("there is no light") != std::string::npos, !lit);
    EXPECT_TRUE(lit || page.find("Rings and crosses are") == std::string::npos);
    EXPECT_EQ(page.find("Largest, at C = ") != std::string::npos, lit);
    EXPECT_EQ(page.find(">nan"), std::string::npos);
    EXPECT_EQ(page.find(">-0<"), std::string::npos);
    EXPECT_THAT(page, testing::HasSubstr("<th class=\"number\">value</th>"));
    Run({"photometry", "x.lf.exr", "--ask", "ask.toml", "-o", "x.pdf"});
    EXPECT_THAT(ReadText(folder_ / "x.pdf"), testing::StartsWith("%PDF-"));
  }
  // Up, down and aside.
  lightfield::RigidPose up;
  up.rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  const std::vector<lightfield::PosedLightField> fields = {{"+z", {}, HillLamp(1e6)},
                                                           {"-z", up, HillLamp(1e6)}};
  lightfield::WriteLightFields(folder_ / "x.lf.exr", fields);
  const json both = Run({"photometry", "x.lf.exr"});
  EXPECT_NEAR(both["upward_share"].get<double>(), 0.5, 1e-6);
  EXPECT_EQ(both["intensity"]["gamma_deg"].back(), 180);
  Page();
}

// Ratings that the scale does not have, darkness, and what noise has put below 0: words on pages, numbers
// or null as JSON.
TEST_F(Photometry, GlareAndUniformityOfDimLampsAreWords) {
  WriteText(folder_ / "ask.toml",
            std::string(kAskedOfALamp) +
                "[[glare]]\nbelow_m = 1.5\ndistances_m = [0.3, 1]\nbackground_cd_per_m2 = 40\n");
  const json dim = Ask(HillLamp(1e4), {"--ask", "ask.toml"});
  EXPECT_LT(dim["eyes"][0]["ugr"].get<double>(), 10);
  const std::string page = Page({"--ask", "ask.toml"});
  EXPECT_THAT(page,
              testing::HasSubstr(">UGR of this lamp alone</td><td class=\"number\">below 10<"));
  EXPECT_THAT(page, testing::HasSubstr("C 0°</th>"));
  EXPECT_EQ(page.find("no luminous area"), std::string::npos);
  EXPECT_TRUE(Ask(HillLamp(1e3), {"--ask", "ask.toml"})["eyes"][0]["luminous_area_m2"].is_null());
  EXPECT_THAT(Page({"--ask", "ask.toml"}), testing::HasSubstr("there is no luminous area to rate"));
  LightField noisy = HillLamp(1e6);
  for (float& c : noisy.data) c -= 6e5f;
  const json found = Ask(noisy, {"--ask", "ask.toml"});
  EXPECT_LT(found["planes"][0]["illuminance_min_lx"].get<double>(), 0);
  EXPECT_TRUE(found["planes"][0]["uniformity_min_mean"].is_null());
  EXPECT_TRUE(found["planes"][0]["uniformity_min_max"].is_null());
  EXPECT_THAT(found["remarks"].dump(), testing::HasSubstr("'wall' is below 0, which is noise"));
}

// Eyes of every kind: in perspective, through a fisheye, so near that a perspective does not hold the
// lamp, behind it, and without a picture. `export` writes the same picture, as bright.
TEST_F(Photometry, EyesHavePicturesInUnits) {
  const auto eye = [](const char* place, const char* more) {
    return fmt::format("[[eye]]\neye_m = {}\n{}\n", place, more);
  };
  const auto pictures = [&](const std::string& asked) {
    WriteText(folder_ / "ask.toml", asked);
    Ask(HillLamp(1e6));
    const std::string page = Page({"--ask", "ask.toml"});
    std::size_t count = 0;
    for (std::size_t at = page.find("luxfield export x.lf.exr"); at != std::string::npos;
         at = page.find("luxfield export x.lf.exr", at + 1))
      ++count;
    return std::pair(count, page);
  };
  EXPECT_EQ(pictures(eye("[0, 0, 1]", "picture = \"none\"")).first, 0u);
  EXPECT_EQ(pictures(eye("[0, 0, -1]", "")).first, 0u);
  EXPECT_THAT(pictures(eye("[0, 0, 0.001]", "")).second, testing::HasSubstr("--view fisheye"));
  const auto [count, page] =
      pictures(eye("[0.3, 0.2, 1]", "") +
               eye("[0.3, 0.2, 1]", "picture = \"fisheye\"\nline_of_sight = [0, 0.2, -1]"));
  EXPECT_EQ(count, 2u);
  EXPECT_THAT(page, testing::HasSubstr(">cd/m²<"));
  EXPECT_THAT(page, testing::HasSubstr("--view fisheye --eye 0.3 0.2 1 --look-at 0.3 0.39"));
  const std::size_t at = page.find("luxfield export x.lf.exr -o X.hdr --view perspective");
  ASSERT_NE(at, std::string::npos);
  std::istringstream words(page.substr(at, page.find('<', at) - at));
  std::vector<std::string> command{std::istream_iterator<std::string>(words), {}};
  command.erase(command.begin());
  const json written = Run(command);
  const json found = Run({"photometry", "x.lf.exr", "--ask", "ask.toml"});
  const auto& fields = found["eyes"][0]["fields_of_view"];
  for (const json& field : fields)
    EXPECT_GE(field["luminance_peak_cd_per_m2"], field["luminance_largest_mean_cd_per_m2"]);
  // The brightest of some pixels, each a mean over it.
  const double peak = fields[2]["luminance_peak_cd_per_m2"];
  EXPECT_NEAR(written["largest"].get<double>(), peak, 0.02 * peak);
}

TEST_F(Photometry, OfThreeChannelsHasColour) {
  LightField field(LampGeometry());
  field.geometry.channels = 3;
  field = LightField(field.geometry);
  const LightField one = HillLamp(1e6);
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (int channel = 0; channel < 3; ++channel)
      std::ranges::copy(one.image(m, 0), field.image(m, channel).begin());
  const json found = Ask(field);
  // White, which is D65.
  EXPECT_NEAR(found["colour"]["mean"]["x"].get<double>(), 0.3127, 1e-4);
  EXPECT_NEAR(found["colour"]["mean"]["cct_k"].get<double>(), 6504, 20);
  EXPECT_LT(found["colour"]["deviation_largest"].get<double>(), 1e-5);
  EXPECT_THAT(Page(), testing::HasSubstr("Correlated colour temperature"));
  Run({"photometry", "x.lf.exr", "-o", "x.cert.json"});
  const json certificate = json::parse(ReadText(folder_ / "x.cert.json"));
  const auto& results = certificate["results"];
  EXPECT_TRUE(std::any_of(results.begin(), results.end(), [&](const json& result) {
    return result["quantity"] == "Correlated colour temperature" &&
           result["value"] == found["colour"]["mean"]["cct_k"];
  }));
}

TEST_F(Photometry, TwoLampsAreComparedInTheWordsOfPhotometry) {
  const LightField a = HillLamp(1.1e6), b = HillLamp(1e6);
  lightfield::WriteLightField(folder_ / "a.lf.exr", a);
  lightfield::WriteLightField(folder_ / "b.lf.exr", b);
  LightField sigma = b;
  for (float& c : sigma.data) c *= 0.01f;
  sigma.provenance["solve"] = "none";
  lightfield::WriteLightField(folder_ / "s.lf.exr", sigma);
  const json found = Run({"compare", "a.lf.exr", "b.lf.exr", "--sigma-a", "s.lf.exr", "--sigma-b",
                          "s.lf.exr", "-o", "x.html"});
  const json& flux = found["photometry"]["quantities"][0];
  EXPECT_EQ(flux["name"], "flux");
  const double expected = lightfield::TotalFlux(b)[0];
  EXPECT_NEAR(flux["difference"].get<double>(), 0.1 * expected, 1e-5 * expected);
  double squares = 0, sum = 0;
  for (const float c : b.data) squares += double(c) * c, sum += c;
  // Coefficients are independent: u / flux = 0.01 sqrt(sum c^2) / sum c, of both lamps.
  EXPECT_NEAR(flux["difference_u"].get<double>(),
              std::sqrt(2.0) * 0.01 * std::sqrt(squares) / sum * expected, 1e-3 * expected);
  EXPECT_NEAR(flux["in_uncertainties"].get<double>(),
              flux["difference"].get<double>() / flux["difference_u"].get<double>(), 1e-9);
  EXPECT_NEAR(found["rel_rmse"].get<double>(),
              0.1 * std::sqrt(squares * double(b.data.size())) / sum, 1e-3);
  const std::string page = ReadText(folder_ / "x.html");
  ExpectSelfContainedPage(page);
  EXPECT_THAT(page, testing::HasSubstr("A - B"));
  // Another geometry: no coefficients, but all that they shine.
  lightfield::LuminaireGeometry other = LampGeometry();
  other.lattice = {8, 8, -0.3, 0.28, 0.075, 0.075};
  LightField coarse(other);
  for (float& c : coarse.data) c = 1e5f;
  lightfield::WriteLightField(folder_ / "c.lf.exr", coarse);
  const json others = Run({"compare", "a.lf.exr", "c.lf.exr"});
  EXPECT_FALSE(others.contains("rel_rmse"));
  EXPECT_TRUE(others["photometry"]["quantities"][0]["in_uncertainties"].is_null());
  lightfield::WriteLightField(folder_ / "w.lf.exr", HillLamp(1, lightfield::FluxUnit::kWatt));
  EXPECT_TRUE(Run({"compare", "a.lf.exr", "w.lf.exr"})["photometry"].is_null());
}

TEST_F(Photometry, HeadlampsAreJudgedByRegulations) {
  const auto regulation = SourceFile("data/regulations/un-r149-01-passing-v.toml");
  std::filesystem::copy(regulation, folder_ / "own.toml");
  WriteText(folder_ / "ask.toml",
            "[[headlamp]]\nregulation = \"own.toml\"\nname = \"left & right\"\ntraffic = "
            "\"left\"\naim_deg = [0.5, -0.2]\n");
  const json found = Ask(HillLamp(1e8), {"--ask", "ask.toml"});
  const json& headlamp = found["headlamps"][0];
  EXPECT_EQ(headlamp["regulation"], "UN R149-01, passing beam, class V");
  EXPECT_EQ(headlamp["verdict"], "fail");  // it has no cut-off
  EXPECT_TRUE(headlamp["pass_probability"].is_null());
  EXPECT_EQ(headlamp["aim_deg"][0], 0.5);
  const auto named = [&](const std::string& name) {
    for (const json& one : headlamp["requirements"])
      if (one["name"] == name) return one;
    return json();
  };
  EXPECT_EQ(named("B50R")["verdict"], "fail");
  EXPECT_EQ(named("50L")["verdict"], "pass");
  EXPECT_EQ(named("50L")["limit_cd"], 5100);
  EXPECT_EQ(named("flux in Zone I")["unless"].get<std::string>().substr(0, 17),
            "the light sources");
  EXPECT_EQ(headlamp["aim_sweep"]["smallest_margin"].size(), 5u);
  EXPECT_GT(headlamp["road"]["illuminance_lx"].size(), 50u);
  const std::string page = Page({"--ask", "ask.toml"});
  EXPECT_THAT(page, testing::HasSubstr("left &amp; right"));
  EXPECT_THAT(page, testing::HasSubstr("Segment 10 and below"));
  Ask(HillLamp(1e8), {"--ask", "ask.toml", "-o", "x.csv"});
  EXPECT_THAT(ReadText(folder_ / "x.csv"), testing::HasSubstr("\nB50R largest,"));
  lightfield::WriteLightField(folder_ / "w.lf.exr", HillLamp(1, lightfield::FluxUnit::kWatt));
  const Outcome refused = RunLuxfield({"photometry", "w.lf.exr", "--ask", "ask.toml"}, folder_);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("ask for candela"));
}

TEST_F(Photometry, OfWattsIsRadiometry) {
  const json found = Ask(HillLamp(1, lightfield::FluxUnit::kWatt));
  EXPECT_GT(found["flux_w"].get<double>(), 0);
  EXPECT_GT(found["intensity_axis_w_per_sr"].get<double>(), 0);
  EXPECT_FALSE(found.contains("flux_lm"));
  EXPECT_THAT(found["remarks"].dump(), testing::HasSubstr("radiometric"));
  EXPECT_TRUE(found["eyes"][0]["luminous_area_m2"].is_null());
  EXPECT_THAT(Page(), testing::HasSubstr("W/sr"));
  EXPECT_GT(Ask(HillLamp(1, lightfield::FluxUnit::kRelative))["flux_relative"].get<double>(), 0);
}

TEST_F(Photometry, WeighsChannelsAsAsked) {
  const std::string plane =
      "[[plane]]\nname = \"canopy\"\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\ncolumns = "
      "3\nrows = 3\n";
  WriteText(folder_ / "ask.toml",
            "[[weighting]]\nname = \"PPFD\"\nunit = \"umol/(m2 s)\"\nfactors = [4.6]\n" + plane +
                plane + "weighting = \"PPFD\"\n" + plane +
                "weighting = \"PPFD\"\nreceiver = \"sphere\"\n[[point]]\nposition_m = [0, 0, 1]\n"
                "weighting = \"PPFD\"\n");
  const json found = Ask(HillLamp(1, lightfield::FluxUnit::kWatt), {"--ask", "ask.toml"});
  const json &watts = found["planes"][0], &photons = found["planes"][1],
             &spheres = found["planes"][2], &point = found["points"][0];
  EXPECT_TRUE(watts["weighting"].is_null());
  EXPECT_EQ(photons["weighting"], "PPFD");
  EXPECT_EQ(photons["unit"], "umol/(m2 s)");
  const double middle = watts["irradiance_w_per_m2"][1][1];
  EXPECT_GT(middle, 0);
  EXPECT_NEAR(photons["irradiance_weighted"][1][1].get<double>(), 4.6 * middle, 1e-6 * middle);
  EXPECT_NEAR(photons["irradiance_mean_weighted"].get<double>(),
              4.6 * watts["irradiance_mean_w_per_m2"].get<double>(), 1e-6 * middle);
  EXPECT_NEAR(point["irradiance_weighted"].get<double>(), 4.6 * middle, 1e-6 * middle);
  EXPECT_NEAR(spheres["irradiance_spherical_weighted"][1][1].get<double>(),
              point["irradiance_spherical_weighted"].get<double>(), 1e-9 * middle);
  EXPECT_GT(spheres["irradiance_spherical_max_weighted"].get<double>(), 0);
  EXPECT_THAT(Page({"--ask", "ask.toml"}), testing::HasSubstr("channels weighed by 4.6"));
  // Of three channels.
  const Outcome refused = [&] {
    WriteText(folder_ / "ask.toml",
              "[[weighting]]\nname = \"PPFD\"\nunit = \"umol/(m2 s)\"\nfactors = [4, 5, 6]\n");
    return RunLuxfield({"photometry", "x.lf.exr", "--ask", "ask.toml"}, folder_);
  }();
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("3 factors, and the light field has 1 channels"));
}

TEST_F(Photometry, LinesVolumesAndPathsAreMadeOfPoints) {
  WriteText(folder_ / "ask.toml", R"([[point]]
position_m = [0.1, 0.2, 1.5]
normal = [0, 0, -1]
[[line]]
name = "a < b"
from_m = [0.1, 0.2, 0.5]
to_m = [0.1, 0.2, 2.5]
points = 5
normal = [0, 0, -1]
[[volume]]
name = "room"
centre_m = [0.1, 0.2, 1.5]
width_m = 1
height_m = 0.8
depth_m = 2
columns = 1
rows = 1
layers = 3
[[path]]
name = "hand"
receiver = "sphere"
[[path.key]]
t_s = 1
position_m = [0.1, 0.2, 1.5]
[[path.key]]
t_s = 3.5
position_m = [0.1, 0.2, 1.5]
)");
  const json found = Ask(HillLamp(1e6), {"--ask", "ask.toml", "-o", "x.pdf"});
  const json& point = found["points"][0];
  const auto near = [&](const json& value, const char* key, double factor) {
    const double expected = factor * point[key].get<double>();
    EXPECT_NEAR(value.get<double>(), expected, 1e-9 * expected) << key;
  };
  const json& line = found["lines"][0];
  EXPECT_EQ(line["illuminance_lx"].size(), 5u);
  near(line["illuminance_lx"][2], "illuminance_lx", 1);
  near(line["illuminance_cylindrical_lx"][2], "illuminance_cylindrical_lx", 1);
  EXPECT_NEAR(line["light_vector_z_lx"][2].get<double>(), point["light_vector_lx"][2].get<double>(),
              1e-6);
  EXPECT_TRUE(line["illuminance_semicylindrical_lx"].is_null());
  EXPECT_TRUE(line["illuminance_lx_u"].is_null());
  const json& volume = found["volumes"][0];
  EXPECT_EQ(volume["illuminance_spherical_lx"].size(), 3u);
  near(volume["illuminance_spherical_lx"][1][0][0], "illuminance_spherical_lx", 1);
  // The nearest layer is the first.
  EXPECT_GT(volume["illuminance_spherical_lx"][0][0][0].get<double>(),
            volume["illuminance_spherical_lx"][2][0][0].get<double>());
  EXPECT_NEAR(volume["max_at_m"][2].get<double>(), 1.5 - 2.0 / 3, 1e-9);
  const json& path = found["paths"][0];
  near(path["dose_lx_s"], "illuminance_spherical_lx", 2.5);
  EXPECT_EQ(path["dose_unit"], "lx s");
  const std::string page = Page({"--ask", "ask.toml"});
  EXPECT_THAT(page, testing::HasSubstr("a &lt; b"));
  EXPECT_THAT(page, testing::HasSubstr("Dose along paths"));
  Ask(HillLamp(1e6), {"--ask", "ask.toml", "-o", "x.csv"});
  EXPECT_THAT(ReadText(folder_ / "x.csv"),
              testing::HasSubstr("dose of spherical illuminance,hand,"));
}

TEST_F(Photometry, MistakesInWhatIsAskedAreNamed) {
  lightfield::WriteLightField(folder_ / "x.lf.exr", HillLamp(1));
  for (const auto& [text, said] :
       {std::pair{"[[point]]\nposition_m = [0, 0, 0]\n", "position_m"},
        std::pair{"[[point]]\nposition_m = [0, 0, 1]\nnormal = [0, 0, 0]\n", "normal"},
        std::pair{"[[plane]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 0\n", "height_m"},
        std::pair{"[[plane]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\nup = [1, 0, 0]\n",
                  "up"},
        std::pair{"[[point]]\nposition_m = [0, 0, 1]\nweighting = \"PPFD\"\n",
                  "'PPFD' is the name of no [[weighting]]"},
        std::pair{"[[weighting]]\nname = \"a\"\nunit = \"1\"\nfactors = [0]\n", "weighs nothing"},
        std::pair{"[[plane]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\nreceiver = "
                  "\"semicylinder\"\n",
                  "facing"},
        std::pair{"[[line]]\nfrom_m = [0, 0, -1]\nto_m = [0, 0, 1]\npoints = 3\n", "points"},
        std::pair{"[[volume]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\ndepth_m = 1\n"
                  "columns = 4096\nrows = 4096\nlayers = 2\n",
                  "layers"},
        std::pair{"[[path]]\n[[path.key]]\nt_s = 0\nposition_m = [0, 0, 1]\n", "has 1 keys"},
        std::pair{"[[path]]\n[[path.key]]\nt_s = 0\nposition_m = [0, 0, 1]\n[[path.key]]\nt_s = 0\n"
                  "position_m = [0, 0, 1]\n",
                  "t_s = 0 is not after"},
        std::pair{"[quality]\nlamp_spectrum = \"a.csv\"\n", "responsivity"},
        std::pair{"[quality]\nresponsivity = \"ask.toml\"\n", "ask.toml: line 2"},
        std::pair{"[[headlamp]]\nregulation = \"un-r1\"\n", "'un-r1' names no file"},
        std::pair{"[[headlamp]]\nregulation = \"x.toml\"\n", "'x.toml' names no file"},
        std::pair{"[[weighting]]\nname = \"a\"\nunit = \"1\"\nfactors = [1]\n[[weighting]]\nname = "
                  "\"a\"\nunit = \"1\"\nfactors = [2]\n",
                  "weighting[1].name = 'a' is empty, or another"},
        std::pair{"[[weighting]]\nname = \"a\"\nunit = \"1\"\nfactors = [nan]\n",
                  "weighting[0].factors must hold finite numbers"},
        std::pair{"[[plane]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\nreceiver = "
                  "\"cube\"\n",
                  "plane[0].receiver = 'cube' is not known; use one of: plane"},
        std::pair{"[[plane]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\nreceiver = "
                  "\"sphere\"\naxis = [0, 0, 1]\n",
                  "plane[0].axis is not a known key"},
        std::pair{"[[line]]\nfrom_m = [0, 0, 1]\nto_m = [0, 0, 2e6]\n",
                  "line[0].to_m lies more than 1e6 m away; give metres"},
        std::pair{"[[line]]\nfrom_m = [0, 0, 1]\nto_m = [0, 0, 2]\nfacing = [0, 0, 3]\n",
                  "line[0].facing points along axis; turn it across"},
        std::pair{"[[volume]]\ncentre_m = [0, 0, 1]\nwidth_m = 1\nheight_m = 1\ndepth_m = nan\n",
                  "volume[0].depth_m = nan must lie in"},
        std::pair{"[[path]]\n[[path.key]]\nt_s = 0\nposition_m = [0, 0, 1]\nnormal = [0, 0, "
                  "1]\n[[path.key]]\nt_s = 1\nposition_m = [0, 0, 1]\nnormal = [0, 0, -1]\n",
                  "path[0].key[1].normal is opposite to that of the key before; add a key"},
        std::pair{"[[path]]\nreceiver = \"sphere\"\n[[path.key]]\nt_s = 0\nposition_m = [0, 0, "
                  "1]\nnormal = [0, 0, 1]\n",
                  "path[0].key[0].normal is of a plane; drop it"},
        std::pair{"[[eye]]\neye_m = [0, 0, 1]\npicture = \"wide\"\n",
                  "eye[0].picture = 'wide' is not known; use one of: perspective"},
        std::pair{"[[eye]]\neye_m = [0, 0, 1]\nup = [0, 0, 0]\n", "eye[0].up has no direction"},
        std::pair{"[[eye]]\neye_m = [0, 0, 1]\nfields_of_view_mrad = [0]\n",
                  "eye[0].fields_of_view_mrad holds 0; give 0.01 to 1000"},
        std::pair{"[quality]\nsensor_calibration = \"ask.toml\"\n", "ask.toml: not valid JSON"},
        std::pair{"[quality]\nresponsivity = 4\n", "quality.responsivity = 4 must be text"},
        std::pair{"[[plain]]\n", "plain"}}) {
    WriteText(folder_ / "ask.toml", text);
    const Outcome refused =
        RunLuxfield({"photometry", "x.lf.exr", "--ask", "ask.toml", "-o", "y.html"}, folder_);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err,
                testing::AllOf(testing::HasSubstr("ask.toml"), testing::HasSubstr(said)));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "y.html"));
  }
}

}  // namespace
}  // namespace luxfield::e2e
