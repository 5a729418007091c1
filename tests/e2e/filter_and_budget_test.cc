// Filters as docs/how-to/measure.md has them printed, photographed, measured and taken into the solve; the
// regularised solve; and the error budget of the session: verb by verb.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/planning/lab_variant.h"
#include "tests/e2e/html_check.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class SmallLab : public VerbTest {
 protected:
  explicit SmallLab(const std::string& name = "small")
      : lab_(SourceFile("data/labs/" + name + ".toml")),
        plan_(SourceFile("data/plans/" + name + ".toml")) {}

  // C of a session merged and reconstructed with these options; with the report.
  Json Reconstruct(const std::string& session, const std::string& name,
                   const std::vector<std::string>& options) {
    const std::string merged = session + ".meas.exr";
    if (!std::filesystem::exists(folder_ / merged))
      Run({"merge", session, "-o", merged, "--lamp-level", "monitor"});
    std::vector<std::string> reconstruct = {"reconstruct", merged, "-o", name + ".lf.exr"};
    reconstruct.insert(reconstruct.end(), options.begin(), options.end());
    return Run(reconstruct);
  }
  // lamp.lf.exr, what the basis can hold of the lab's lamp, and lab.toml, the lab with that lamp: C
  // has a truth whatever the filter.
  void LetTheBasisHoldTheLamp() {
    Run({"simulate", lab_, "--plan", plan_, "-o", "lamp.lf.exr", "--non-negative"});
    std::string lab = ReadText(lab_);
    const std::string lamp = "kind = \"headlight\"";
    lab.replace(lab.find(lamp), lamp.size(),
                "kind = \"lightfield\"\nfile = \"" + (folder_ / "lamp.lf.exr").string() + "\"");
    WriteText(folder_ / "lab.toml", lab);
  }
  // Root mean square of C's error over the mean of C.
  double Error(const std::string& name, const std::string& truth) {
    return Run({"compare", name + ".lf.exr", truth + ".lf.exr"}).at("rel_rmse");
  }

  const std::string lab_, plan_;
};

// Towards the lamp.
double IrradianceAt(const lightfield::LightField& field, lightfield::Vec3 at) {
  return lightfield::ExactIrradiance(field, at, {0, 0, -1})[0];
}

TEST_F(SmallLab, FilterIsPrintedAsTheLabHasIt) {
  const Json single = Run({"filter", "print", "--lab", lab_, "-o", "f", "--dpi", "300"});
  EXPECT_EQ(single.at("files").size(), 3u);
  EXPECT_THAT(ReadText(folder_ / "f.pdf"), testing::StartsWith("%PDF"));
  const Json sheet = Json::parse(ReadText(folder_ / "f.sheet.json"));
  EXPECT_EQ(sheet.at("basis"), "bspline2");
  EXPECT_EQ(sheet.at("spacing_m"), 0.033);
  const cv::Mat print = cv::imread((folder_ / "f.tif").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(print.type(), CV_16UC1);
  const double dots_per_m = 300 / 0.0254, side_m = single.at("side_m");
  EXPECT_EQ(print.cols, std::lround(side_m * dots_per_m));
  // Phi at its peak, where the scale makes it 1, and one spacing beside: B(1) / B(0) = 1/6. A dot
  // is 0.26 % of a spacing, and the print is steepest there: 1 % of it.
  const auto code = [&](double s_m) {
    return print.at<std::uint16_t>(print.rows / 2,
                                   static_cast<int>((0.5 * side_m + s_m) * dots_per_m));
  };
  EXPECT_NEAR(code(0) / 65535.0, 1, 1e-3);
  EXPECT_NEAR(code(0.033) / 65535.0, 1.0 / 6, 0.01 / 6);
  EXPECT_EQ(code(1.6 * 0.033), 0);

  const Json dual = Run({"filter", "print", "-o", "d", "--dual", "--basis", "quadratic",
                         "--spacing", "33mm", "--dpi", "150"});
  EXPECT_EQ(dual.at("files").size(), 4u);
  for (const char* half : {"d.plus.tif", "d.minus.tif"})
    EXPECT_FALSE(cv::imread((folder_ / half).string(), cv::IMREAD_UNCHANGED).empty()) << half;
}

// The small lab's filter before its own bench, shifted, 2 % too dense and of a steeper tone.
constexpr const char* kPrintErrors = R"([errors.registration]
shift_m = [2e-4, -1.5e-4]
rotation_deg = 0.3
[errors.density]
relative = -0.02
gamma = 0.05
)";

void ExpectPrintIsFound(const Json& readings) {
  const Json& print = readings.at("prints").at(0);
  const double sigma_m = print.at("shift_sigma_m");
  std::printf("  shift (%.1f, %.1f) um +- %.1f um, wedge %.4f to %.4f\n",
              1e6 * print.at("shift_x_m").get<double>(), 1e6 * print.at("shift_y_m").get<double>(),
              1e6 * sigma_m, print.at("wedge")[0].at("density").get<double>(),
              print.at("wedge")[10].at("density").get<double>());
  EXPECT_LT(sigma_m, 5e-6);
  EXPECT_NEAR(print.at("shift_x_m").get<double>(), 2e-4, 4.5 * sigma_m);
  EXPECT_NEAR(print.at("shift_y_m").get<double>(), -1.5e-4, 4.5 * sigma_m);
  EXPECT_NEAR(print.at("rotation_rad").get<double>(), 0.3 * 3.14159265 / 180,
              4.5 * print.at("rotation_sigma_rad").get<double>());
  // T = 0.98 t^1.05 of the code t: the clear step, and the tenth, of density 1.5.
  for (const auto& [step, density] : {std::pair{0, 0.0}, {10, 1.5}}) {
    const Json& seen = print.at("wedge").at(static_cast<std::size_t>(step));
    EXPECT_NEAR(seen.at("density").get<double>(), 1.05 * density - std::log10(0.98),
                5 * seen.at("sigma").get<double>() + 2e-4)
        << step;
  }
}

TEST_F(SmallLab, FilterIsMeasuredFromASessionAndFromPhotographs) {
  const std::string bench = R"([lab]
driver = "sim"
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.02
scale = 1.7777777777777777
[filter.bench]
irradiance = 5500
[lamp]
kind = "square"
side_m = 0.06
radiance = 1000
[camera]
pitch_m = 0.01
width = 360
height = 320
bits = 14
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
min_exposure_s = 1e-4
max_exposure_s = 100
responsivity_e_per_s_per_w_m2 = [1000]
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
[errors.photon_noise]
[errors.read_noise]
rms_dn = 1.6
[errors.vignetting]
corner_loss = 0.2
)" + std::string(kPrintErrors);
  WriteText(folder_ / "bench.toml", bench);
  WriteText(folder_ / "plan.toml",
            "[plan]\nkind = \"filter\"\n[exposure]\nmin_s = 0.01\nmax_s = 1.28\n");
  Run({"capture", "plan.toml", "print", "--lab", "bench.toml"});
  ExpectPrintIsFound(
      Run({"filter", "measure", "print", "-o", "s.filter.exr", "--tone", "film.tone.toml"}));
  // A print by that table: the wedge's own codes now mean their densities.
  Run({"filter", "print", "-o", "again", "--spacing", "20mm", "--dpi", "150", "--tone",
       "film.tone.toml"});
  EXPECT_TRUE(std::filesystem::exists(folder_ / "again.tif"));

  Run({"filter", "photograph", "bench.toml", "-o", "h", "--pixels", "320"});
  ExpectPrintIsFound(Run({"filter", "measure", "--sheet", "h.sheet.json", "--light", "h.light.exr",
                          "--print", "h.print.exr", "-o", "p.filter.exr"}));
  EXPECT_EQ(Run({"info", "p.filter.exr"}).at("kind"), Run({"info", "s.filter.exr"}).at("kind"));
}

// The lab with `noise` alone and a perfect print, and one whose print errs.
class PrintedFilter : public SmallLab {
 protected:
  using SmallLab::SmallLab;

  void CaptureBehindPerfectAndWrongPrints() {
    LetTheBasisHoldTheLamp();
    // What the lab's own four nodes miss of a turned pair is more than its noise.
    std::string lab = ReadText(folder_ / "lab.toml");
    const std::string coarse = "u_per_cell = 4";
    lab.replace(lab.find(coarse), coarse.size(), "u_per_cell = 12");
    WriteText(folder_ / "lab.toml", lab);
    planning::WriteLabVariant(folder_ / "lab.toml", {"photon_noise", "read_noise"}, false,
                              folder_ / "perfect.toml");
    planning::WriteLabVariant(folder_ / "lab.toml",
                              {"photon_noise", "read_noise", "registration", "density"}, false,
                              folder_ / "wrong.toml",
                              {{"registration", "shift_m", {3e-4, -3e-4}},
                               {"registration", "rotation_deg", {0.1}},
                               {"density", "relative", {0.02}},
                               {"density", "gamma", {0.01}}});
    for (const char* name : {"perfect", "wrong"})
      Run({"capture", plan_, name, "--lab", std::string(name) + ".toml"});
  }
  // Errors of C: behind the perfect print, behind the wrong one taken as ideal and as measured.
  void Compare(const std::string& filter) {
    floor_ = Reconstruct("perfect", "floor", {});
    ideal_ = Reconstruct("wrong", "ideal", {});
    measured_ = Reconstruct("wrong", "measured", {"--filter", filter});
    at_floor_ = Error("floor", "lamp");
    assumed_ = Error("ideal", "lamp");
    found_ = Error("measured", "lamp");
    std::printf(
        "RMSE of C over its mean: perfect print %.4f, print assumed ideal %.4f, as measured %.4f\n",
        at_floor_, assumed_, found_);
  }

  Json floor_, ideal_, measured_;
  double at_floor_ = 0, assumed_ = 0, found_ = 0;
};

TEST_F(PrintedFilter, AsMeasuredBringsCBackToTheNoiseOfAPerfectPrint) {
  CaptureBehindPerfectAndWrongPrints();
  Run({"filter", "photograph", "wrong.toml", "-o", "h", "--pixels", "320"});
  Run({"filter", "measure", "--sheet", "h.sheet.json", "--light", "h.light.exr", "--print",
       "h.print.exr", "-o", "h.filter.exr"});
  Compare("h.filter.exr");
  EXPECT_EQ(ideal_.at("solve"), "gram");
  EXPECT_EQ(measured_.at("solve"), "general");
  EXPECT_GT(measured_.at("condition").get<double>(), 1);
  EXPECT_GT(assumed_, 1.5 * at_floor_);
  EXPECT_LT(found_, 1.1 * at_floor_);
}

class PrintedPair : public PrintedFilter {
 protected:
  PrintedPair() : PrintedFilter("small-dual") {}

  std::string Refusal(const std::vector<std::string>& arguments) {
    const Outcome outcome = RunLuxfield(arguments, folder_);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  }
};

// Print both halves, photograph both, measure, reconstruct with them.
TEST_F(PrintedPair, AsMeasuredBringsCBackToTheNoiseOfAPerfectOne) {
  CaptureBehindPerfectAndWrongPrints();
  Run({"filter", "print", "--lab", lab_, "-o", "d", "--dpi", "150"});
  Run({"filter", "photograph", "wrong.toml", "-o", "h", "--pixels", "320"});
  const std::vector<std::string> measure = {"filter",  "measure",     "--sheet", "d.sheet.json",
                                            "--light", "h.light.exr", "-o",      "h.filter.exr"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), measure.begin(), measure.end());
    return more;
  };
  EXPECT_THAT(Refusal(with({"--print", "h.plus.exr"})), HasSubstr("1 of prints, the sheet has 2"));
  EXPECT_THAT(Refusal(with({"--print", "h.minus.exr", "h.plus.exr"})),
              HasSubstr("looks like its minus part"));
  EXPECT_EQ(Run(with({"--print", "h.plus.exr", "h.minus.exr"})).at("prints").size(), 2u);
  Compare("h.filter.exr");
  EXPECT_EQ(ideal_.at("solve"), "none");
  EXPECT_EQ(measured_.at("solve"), "general");
  EXPECT_GT(measured_.at("condition").get<double>(), 1);
  EXPECT_GT(assumed_, 2.5 * at_floor_);
  EXPECT_LT(found_, 1.1 * at_floor_);

  WriteText(folder_ / "in_span.toml", "[uncertainty]\nestimate_basis = false\n");
  const Json budget = Run({"budget", "wrong", "--filter", "h.filter.exr", "--lamp-level", "monitor",
                           "--uncertainty", "in_span.toml"});
  const Json& flux = budget.at("quantities").at(0);
  const double value = flux.at("value"), sigma = flux.at("sigma"),
               truth = Run({"info", "lamp.lf.exr"}).at("flux").at(0);
  std::printf("flux: %.6g +- %.2g, true %.6g\n", value, sigma, truth);
  EXPECT_NEAR(value, truth, 4 * sigma);
  EXPECT_LT(sigma, 0.01 * truth);
  for (const char* source : {"filter noise", "print shift", "density"})
    EXPECT_GT(flux.at("sources").at(source).get<double>(), 0) << source;
}

TEST_F(SmallLab, RegularisedSolveStatesItsBiasAndErrsLess) {
  LetTheBasisHoldTheLamp();
  // Loud read-out: noise is what there is to win by.
  planning::WriteLabVariant(folder_ / "lab.toml", {"photon_noise", "read_noise"}, false,
                            folder_ / "loud.toml", {{"read_noise", "rms_dn", {160}}});
  Run({"capture", plan_, "loud", "--lab", "loud.toml"});
  const Json plain = Reconstruct("loud", "plain", {}),
             regularised = Reconstruct("loud", "auto", {"--regularise", "auto"}),
             fixed = Reconstruct("loud", "fixed", {"--regularise", "0.25"});
  EXPECT_FALSE(plain.contains("regularisation"));
  const Json& r = regularised.at("regularisation");
  const double before = Error("plain", "lamp"), after = Error("auto", "lamp");
  std::printf("%s\nRMSE %.4f, %.4f, %.4f\n", r.dump().c_str(), before, after,
              Error("fixed", "lamp"));
  EXPECT_TRUE(r.at("chosen").get<bool>());
  EXPECT_LT(r.at("noise").get<double>(), r.at("noise_before").get<double>());
  EXPECT_GT(r.at("bias").get<double>(), 0);
  EXPECT_LT(after, before);
  EXPECT_FALSE(fixed.at("regularisation").at("chosen").get<bool>());
  EXPECT_EQ(fixed.at("regularisation").at("lambda"), 0.25);
  EXPECT_GT(fixed.at("regularisation").at("bias").get<double>(), r.at("bias").get<double>());
}

// All errors of the small lab, at the sizes that its lab.toml has, and a light meter that reads a
// tenth too much all over.
TEST_F(SmallLab, BudgetCoversTheErrorAndSharesItOut) {
  LetTheBasisHoldTheLamp();
  Run({"capture", plan_, "s", "--lab", "lab.toml"});
  const auto lamp = lightfield::ReadLightField(folder_ / "lamp.lf.exr");
  const double flux = Run({"info", "lamp.lf.exr"}).at("flux").at(0);
  std::string settings = R"([uncertainty]
shutter_jitter_s = 1e-6
lamp_wander = 0.002
lamp_wander_period_s = 1800
monitor = 2e-4
stage_m = 5e-6
print_shift_m = 3e-5
density = 0.002
density_gamma = 0.002
grain = 0.01
grain_area_m2 = 1e-6
stray_share = 5e-4
estimate_basis = false
)";
  WriteText(folder_ / "sizes.toml", settings);
  settings += "[meter]\ncalibration = 0.005\n";
  for (const double z_m : {0.8, 1.3, 2.0})
    settings += fmt::format("[[meter.reading]]\np_m = [0.05, 0, {}]\nvalue = {}\nsigma = {}\n", z_m,
                            1.1 * IrradianceAt(lamp, {0.05, 0, z_m}),
                            0.01 * IrradianceAt(lamp, {0.05, 0, z_m}));
  WriteText(folder_ / "meter.toml", settings);

  const std::vector<std::string> common = {"budget", "s", "--lamp-level", "monitor", "--at",
                                           "0.1",    "0", "1.5"};
  const auto budget = [&](const std::vector<std::string>& options) {
    auto arguments = common;
    arguments.insert(arguments.end(), options.begin(), options.end());
    return Run(arguments);
  };
  const Json json = budget({"--uncertainty", "sizes.toml", "--report", "budget.html"});
  ASSERT_EQ(json.at("quantities").size(), 2u);
  const double truth[] = {flux, IrradianceAt(lamp, {0.1, 0, 1.5})};
  for (std::size_t q = 0; q < 2; ++q) {
    const Json& quantity = json.at("quantities")[q];
    double square = 0;
    for (const auto& [name, sigma] : quantity.at("sources").items())
      square += sigma.is_null() ? 0 : std::pow(sigma.get<double>(), 2);
    const double value = quantity.at("value"), sigma = quantity.at("sigma");
    std::printf("  %s: %.6g +- %.2g, true %.6g\n", quantity.at("name").get<std::string>().c_str(),
                value, sigma, truth[q]);
    EXPECT_NEAR(sigma, std::sqrt(square), 1e-9 * sigma);
    EXPECT_NEAR(value, truth[q], 4 * sigma);
    EXPECT_LT(sigma, 0.01 * truth[q]);
    for (const char* source :
         {"photon noise", "read noise", "PRNU", "shutter", "lamp drift", "monitor", "stage",
          "print shift", "density", "density gamma", "grain", "stray light"})
      EXPECT_GT(quantity.at("sources").at(source).get<double>(), 0) << source;
    for (const char* source : {"exposure times", "image shift", "geometry", "basis", "light meter"})
      EXPECT_TRUE(quantity.at("sources").at(source).is_null()) << source;
  }
  const std::string page = ReadText(folder_ / "budget.html");
  ExpectSelfContainedPage(page);
  const Json& first = json.at("quantities")[0];
  for (const auto& part : {std::string("Session s."), std::string("<h2>flux"),
                           std::string("irradiance at (0.1, 0, 1.5)"),
                           fmt::format("{:.5g} +- {:.2g} lm", first.at("value").get<double>(),
                                       first.at("sigma").get<double>()),
                           std::string("stray light"), std::string("not stated")})
    EXPECT_NE(page.find(part), std::string::npos) << part;

  // Exposure times from the frames: what is left of them is known without being stated.
  const Json estimated = budget({"--uncertainty", "sizes.toml", "--estimate-exposures"});
  const Json& flux_again = estimated.at("quantities")[0];
  EXPECT_GT(flux_again.at("sources").at("exposure times").get<double>(), 0);
  EXPECT_NEAR(flux_again.at("value").get<double>(), flux, 4 * flux_again.at("sigma").get<double>());
  EXPECT_NE(flux_again.at("value"), first.at("value"));

  const Json scaled = budget({"--uncertainty", "meter.toml"});
  const Json& factor = scaled.at("scale").at("factor");
  std::printf("  factor %.5f +- %.5f\n", factor.at("value").get<double>(),
              factor.at("sigma").get<double>());
  EXPECT_NEAR(factor.at("value").get<double>(), 1.1, 4 * factor.at("sigma").get<double>());
  EXPECT_EQ(scaled.at("scale").at("residuals").size(), 3u);
  const Json& by_meter = scaled.at("quantities")[0];
  EXPECT_NEAR(by_meter.at("value").get<double>(),
              factor.at("value").get<double>() * first.at("value").get<double>(), 1e-6 * flux);
  EXPECT_GT(by_meter.at("sources").at("light meter").get<double>(), 0.005 * 1.1 * flux);
  EXPECT_TRUE(json.at("basis").is_null());

  // Unless the lamp is known to lie in the span, what the basis may lose of it is estimated.
  const Json unstated = budget({"--report", "unstated.html"});
  EXPECT_EQ(unstated.at("basis"), "estimated");
  const Json& irradiance = unstated.at("quantities")[1];
  const double basis = irradiance.at("sources").at("basis");
  EXPECT_GT(basis, 0);
  EXPECT_LT(basis, 0.5 * irradiance.at("value").get<double>());
  EXPECT_NE(ReadText(folder_ / "unstated.html").find("basis, estimated"), std::string::npos);
}

}  // namespace
}  // namespace luxfield::e2e
