// Calibrations as docs/how-to/calibrate.md takes them, verb by verb: a session of the simulated lab, the file and
// the page that `calibrate` makes of it, and what `merge` does with the file. Figures are held
// against what the lab was told to be.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/exr.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/lightfield/measurements.h"
#include "tests/e2e/html_check.h"
#include "tests/e2e/verb_test.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;

class Calibrate : public VerbTest {
 protected:
  // The session of a plan in a lab, both as text.
  void Capture(const std::string& name, const std::string& lab, const std::string& plan) {
    WriteText(folder_ / (name + ".lab.toml"), lab);
    WriteText(folder_ / (name + ".plan.toml"), plan);
    Run({"capture", name + ".plan.toml", name, "--lab", name + ".lab.toml"});
  }

  // Merges a session with these options.
  lightfield::Measurements Merged(const std::string& session,
                                  const std::vector<std::string>& options) {
    std::vector<std::string> merge = {"merge", session, "-o", "x.meas.exr"};
    merge.insert(merge.end(), options.begin(), options.end());
    Run(merge);
    return lightfield::ReadMeasurements(folder_ / "x.meas.exr");
  }

  std::string Page(const std::string& file) {
    const std::string html = ReadText(folder_ / file);
    ExpectSelfContainedPage(html);
    return html;
  }
};

void ExpectHolds(const std::string& page, const std::string& part) {
  EXPECT_NE(page.find(part), std::string::npos) << "the page lacks '" << part << "'";
}

int Times(const std::string& page, const std::string& part) {
  int times = 0;
  for (std::size_t at = page.find(part); at != std::string::npos; at = page.find(part, at + 1))
    ++times;
  return times;
}

// Texels that bear a flag.
int Count(const lightfield::Measurements& measured, std::uint32_t flag) {
  int count = 0;
  for (const auto& p : measured.positions)
    for (const std::uint32_t mask : p.mask) count += (mask & flag) != 0;
  return count;
}

double MedianRatio(const lightfield::Measurements& above, const lightfield::Measurements& below) {
  std::vector<double> ratios;
  for (std::size_t m = 0; m < below.positions.size(); ++m)
    for (std::size_t k = 0; k < below.positions[m].mask.size(); ++k)
      ratios.push_back(above.positions[m].irradiance[k] / below.positions[m].irradiance[k]);
  return core::Median(std::move(ratios));
}

// Within 4.5 standard errors.
void ExpectIs(const Json& json, const std::string& key, double truth) {
  const double value = json.at(key), sigma = json.at(key + "_sigma");
  std::printf("  %-22s %.6g +- %.2g, true %.6g\n", key.c_str(), value, sigma, truth);
  EXPECT_GT(sigma, 0) << key;
  EXPECT_NEAR(value, truth, 4.5 * sigma) << key;
}

// Images against the truth times the one factor that fits best.
struct Agreement {
  double factor = 0, rms = 0, chi_squared = 0, texels = 0;  // chi_squared: per texel
};

Agreement Compare(const lightfield::Measurements& measured, const lightfield::Measurements& truth) {
  double above = 0, below = 0;
  Agreement result;
  const auto each = [&](auto what) {
    for (std::size_t m = 0; m < truth.positions.size(); ++m) {
      const auto& p = measured.positions[m];
      for (std::size_t k = 0; k < p.mask.size(); ++k)
        if (!(p.mask[k] & lightfield::kUnknownMask))
          what(p.irradiance[k], truth.positions[m].irradiance[k], p.sigma[k]);
    }
  };
  each([&](double e, double t, double sigma) {
    above += e * t / (sigma * sigma);
    below += t * t / (sigma * sigma);
  });
  result.factor = above / below;
  double square = 0;
  each([&](double e, double t, double sigma) {
    result.rms += std::pow(e - result.factor * t, 2);
    square += std::pow(result.factor * t, 2);
    result.chi_squared += std::pow((e - result.factor * t) / sigma, 2);
    ++result.texels;
  });
  result.rms = std::sqrt(result.rms / square);
  result.chi_squared /= result.texels;
  return result;
}

// A camera of 96 x 80 pixels whose pixels differ by 1 %, whose corners lose a fifth, and of which
// three are hot: nobody told the session of the last two.
std::string SensorLab(double pitch_m, double lamp_side_m, double radiance, bool ideal) {
  return fmt::format(R"([lab]
driver = "sim"
seed = 3
ideal = {}
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.0165
[lamp]
kind = "square"
side_m = {}
radiance = {}
[camera]
width = 96
height = 80
pitch_m = {}
bits = 14
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
responsivity_e_per_s_per_w_m2 = [1200]
min_exposure_s = 1e-4
max_exposure_s = 10
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
[errors.photon_noise]
[errors.read_noise]
rms_dn = 1.6
[errors.dark_current]
e_per_s = 20
[errors.prnu]
rms = 0.01
[errors.hot_pixels]
count = 3
e_per_s = 5000
calibrated = false
[errors.vignetting]
corner_loss = 0.2
calibrated = false
[errors.monitor_noise]
relative = 2e-4
)",
                     ideal, lamp_side_m, radiance, pitch_m);
}

constexpr const char* kSensorPlan = R"([plan]
kind = "sensor"
[exposure]
min_s = 0.01
max_s = 1.6
levels = 14
)";

constexpr const char* kLampPlan = R"([plan]
unit = "W"
dark_repeats = 2
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.0165
[grid]
width = 2
height = 2
[lattice]
width = 20
height = 16
ds_m = 0.016
[exposure]
min_s = 0.001
max_s = 1
[reference]
every = 0
[warm_up]
window_s = 10
)";

TEST_F(Calibrate, SensorAndFlatField) {
  Capture("flats", SensorLab(5e-5, 1, 26700, false), kSensorPlan);
  const Json json =
      Run({"calibrate", "sensor", "flats", "-o", "camera.cal.json", "--report", "camera.html"});
  const Json& sensor = json.at("sensor");
  ExpectIs(sensor, "gain_dn_per_e", 0.16);
  ExpectIs(sensor, "read_noise_dn", 1.6);
  ExpectIs(sensor, "black_dn", 400);
  ExpectIs(sensor, "dark_current_e_per_s", 20);
  ExpectIs(sensor, "prnu", 0.01);
  EXPECT_EQ(sensor.at("saturation_dn"), 16000);
  EXPECT_EQ(json.at("hot_pixels").size(), 3u);
  const std::string page = Page("camera.html");
  for (const char* part : {"96 x 80 pixels, 14 bit; 3 hot and 0 dead", "electrons per DN",
                           "Photon transfer, sensor", "Residuals of the fit", "Deviation from"})
    ExpectHolds(page, part);
  ExpectHolds(page, fmt::format("{:.3f} +-", sensor.at("gain_e_per_dn").get<double>()));

  const Json flat = Run({"calibrate", "flat-field", "flats", "--calibration", "camera.cal.json",
                         "-o", "camera.flat.exr"});
  EXPECT_EQ(flat.at("kind"), "measured");  // 1 % of pattern, a third of that in noise
  EXPECT_NEAR(flat.at("pattern").get<double>(), 0.01, 0.001);
  const Outcome misnamed = RunLuxfield(
      {"calibrate", "flat-field", "flats", "--calibration", "camera.cal.json", "-o", "flat.exr"},
      folder_);
  EXPECT_EQ(misnamed.exit_code, 2);
  EXPECT_NE(misnamed.err.find("flat.exr must end in .flat.exr"), std::string::npos) << misnamed.err;

  Capture("ideal", SensorLab(0.004, 0.1, 8e5, true), kLampPlan);
  Capture("lamp", SensorLab(0.004, 0.1, 8e5, false), kLampPlan);
  const auto truth = Merged("ideal", {}), stated = Merged("lamp", {}),
             calibrated = Merged("lamp", {"--calibration", "camera.cal.json"}),
             both = Merged("lamp",
                           {"--calibration", "camera.cal.json", "--flat-field", "camera.flat.exr"});
  // E is electrons, so it goes with 1 / gain; and the hot pixels that nobody knew are left out.
  EXPECT_NEAR(MedianRatio(calibrated, stated), 0.16 / sensor.at("gain_dn_per_e").get<double>(),
              1e-4);
  EXPECT_EQ(Count(stated, lightfield::kPartlyDefect), 0);
  EXPECT_EQ(Count(calibrated, lightfield::kPartlyDefect), 3 * 4);
  const Agreement before = Compare(stated, truth), after = Compare(both, truth);
  for (const Agreement& a : {before, after})
    std::printf("  E is off by %.4f %% beside a factor of %.5f; chi^2 %.3f of %g texels\n",
                100 * a.rms, a.factor, a.chi_squared, a.texels);
  EXPECT_GT(before.rms, 0.02);  // vignetting, as nobody stated it
  EXPECT_LT(after.rms, 0.002);  // noise
  // The four positions share the pixels and so the map's errors: half as many degrees, and 4.5
  // standard errors.
  EXPECT_NEAR(after.chi_squared, 1, 4.5 * std::sqrt(4 / after.texels));
  // The gain's standard error is the factor's.
  EXPECT_NEAR(after.factor, 1, 4.5 * sensor.at("gain_dn_per_e_sigma").get<double>() / 0.16 + 1e-4);
  for (const char* key : {"sensor_calibration", "flat_field"})
    EXPECT_EQ(both.provenance.count(key), 1u) << key;
}

// The lab's own file, with fewer poses of the board.
TEST_F(Calibrate, Geometry) {
  const std::string lab = ReadText(SourceFile("data/labs/reflector-geometry.toml"));
  Capture("targets", lab,
          "[plan]\nkind = \"geometry\"\nposes = 5\n[stage]\nstep_m = 0.05\n[exposure]\n"
          "min_s = 0.05\nmax_s = 10\n");
  const Json json =
      Run({"calibrate", "geometry", "targets", "-o", "bench.cal.json", "--report", "bench.html"});
  EXPECT_EQ(json.at("parameters").size(), 23u);
  EXPECT_TRUE(json.at("not_found").empty());
  // What [errors.geometry] says, on top of what the lab states.
  std::map<std::string, double> truth = {
      {"focal_x", 560 * 1.01}, {"k1", -0.08},    {"camera_s", 0.356},     {"camera_t", 0.196},
      {"camera_z", -0.745},    {"delta", 0.304}, {"stage_scale_u", 1.002}};
  double delta_sigma_m = 0;
  for (const Json& p : json.at("parameters")) {
    if (p.at("name") == "delta") delta_sigma_m = p.at("sigma");
    const auto found = truth.find(p.at("name"));
    if (found == truth.end()) continue;
    std::printf("  %-14s %.8g +- %.2g, true %.8g\n", found->first.c_str(),
                p.at("value").get<double>(), p.at("sigma").get<double>(), found->second);
    EXPECT_NEAR(p.at("value").get<double>(), found->second, 4.5 * p.at("sigma").get<double>())
        << found->first;
    truth.erase(found);
  }
  EXPECT_TRUE(truth.empty()) << truth.begin()->first << " is not among the parameters";
  EXPECT_LT(delta_sigma_m, 2e-5);

  const std::string page = Page("bench.html");
  for (const char* part :
       {"<h2>Parameters", "<h2>Residuals", "<h2>Views", "camera_pan", "board on I",
        "Against the distance from the picture", "Against the place within", "residual / sigma"})
    ExpectHolds(page, part);
  ExpectHolds(page, fmt::format("<td>delta</td><td class=\"number\">{:.4f}",
                                1e3 * json.at("delta_m").get<double>()));
  // A mark in the cloud for every corner, two in each of the plots below it, and one for each of
  // the ten series' names.
  const auto used = [&](const char* noise) {
    return json.at(noise).at("corners").get<int>() - json.at(noise).at("left_out").get<int>();
  };
  EXPECT_EQ(Times(page, "<circle") + Times(page, "<polygon"),
            5 * (used("board_noise") + used("mask_noise")) + 10);

  std::string plan = ReadText(SourceFile("data/plans/small-reflector.toml"));
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(plan.find(from), std::string::npos) << from;
    plan.replace(plan.find(from), from.size(), to);
  };
  replace("width = 5\nheight = 4", "width = 2\nheight = 1");
  Capture("lamp", lab, plan);
  const auto stated = Merged("lamp", {}),
             calibrated = Merged("lamp", {"--calibration", "bench.cal.json"});
  EXPECT_EQ(stated.geometry.delta_m, 0.3);
  EXPECT_EQ(calibrated.geometry.delta_m, json.at("delta_m").get<double>());
  EXPECT_EQ(calibrated.provenance.count("geometry_calibration"), 1u);
  // The stage's axis u is 0.2 % longer than planned and turned: half a spacing from the middle.
  EXPECT_EQ(stated.positions[1].displacement_m.x, 0);
  const double u_m = 0.5 * 0.033;
  EXPECT_NEAR(calibrated.positions[1].displacement_m.x, 0.002 * u_m, 5e-6);
  EXPECT_NEAR(calibrated.positions[1].displacement_m.y, u_m * 0.2 * 3.14159 / 180, 5e-6);

  // What merging leaves out of the tilted planes stands beside the budget.
  const Json budget =
      Run({"budget", "lamp", "--calibration", "bench.cal.json", "--report", "budget.html"});
  EXPECT_GT(budget.at("tilt").at("light").get<double>(), 1e-4);
  ExpectHolds(Page("budget.html"), "planes not parallel, in no row: E off by up to");
  EXPECT_FALSE(Run({"budget", "lamp"}).contains("tilt"));
}

// Light strayed evenly: the veil that the share is exact for.
constexpr double kShare = 8e-4;

const std::string kGlareLab = fmt::format(R"([lab]
driver = "sim"
seed = 4
[rig]
kind = "reflector"
delta_m = 0.3
albedo = 0.9
[filter]
spacing_m = 0.03
[lamp]
kind = "square"
side_m = 0.1
radiance = 3e5
[camera]
width = 160
height = 120
bits = 14
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
responsivity_e_per_s_per_w_m2 = [1200]
min_exposure_s = 1e-4
max_exposure_s = 100
[camera.lens]
focal_px = [190, 190]
position_m = [0.2, 0.1, -0.75]
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
[targets]
spacer_m = 0.05
source_m = [0, 0, -0.3]
source_intensity = 20
room_irradiance = 30
[targets.board]
columns = 4
rows = 3
pitch_m = 0.01
[targets.mask]
columns = 4
rows = 3
pitch_m = 0.01
[targets.trap]
radius_m = 0.06
places = 2
[errors.photon_noise]
[errors.read_noise]
rms_dn = 1.6
[errors.stray_light]
share = {}
)",
                                          kShare);

TEST_F(Calibrate, Glare) {
  Capture("trap", kGlareLab,
          "[plan]\nkind = \"glare\"\nplaces = 2\n[exposure]\nmin_s = 0.01\nmax_s = 10\n"
          "repeats = 8\n");
  const Json json = Run({"calibrate", "glare", "trap", "-o", "glare.cal.json"});
  ExpectIs(json, "share", kShare);
  EXPECT_LT(json.at("share_sigma").get<double>(), 0.1 * kShare);
  EXPECT_GT(json.at("bound").get<double>(), json.at("share").get<double>());

  Capture("lamp", kGlareLab, R"([plan]
unit = "W"
dark_repeats = 1
[rig]
kind = "reflector"
albedo = 0.9
delta_m = 0.3
[filter]
spacing_m = 0.03
[grid]
width = 2
height = 2
[lattice]
width = 12
height = 12
ds_m = 0.02
[exposure]
min_s = 0.001
max_s = 10
[reference]
every = 0
[warm_up]
window_s = 10
)");
  const auto stated = Merged("lamp", {}),
             calibrated = Merged("lamp", {"--calibration", "glare.cal.json"});
  EXPECT_EQ(stated.provenance.count("glare_share"), 0u);
  const double share = json.at("share"), sigma = json.at("share_sigma");
  EXPECT_EQ(calibrated.provenance.at("glare_share"), fmt::format("{:.3g} +- {:.1g}", share, sigma));
  EXPECT_EQ(calibrated.positions[0].irradiance, stated.positions[0].irradiance)
      << "nothing is subtracted";

  // The budget takes the share where nobody states one; it is in proportion to it.
  WriteText(folder_ / "budget.toml", "[uncertainty]\nstray_share = 8e-3\n");
  const auto stray = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"budget", "lamp"});
    return Run(options).at("quantities").at(0).at("sources").at("stray light");
  };
  EXPECT_TRUE(stray({}).is_null());
  const double as_stated = stray({"--uncertainty", "budget.toml"}),
               as_measured = stray({"--calibration", "glare.cal.json"});
  EXPECT_GT(as_stated, 0);
  EXPECT_NEAR(as_measured / as_stated, std::hypot(share, sigma) / 8e-3, 1e-9);
}

// Pictures of a grey ramp over 10 stops by a camera that develops: a power of 0.6 with a toe and a
// shoulder, 20000 electrons in all, read noise 6.
constexpr int kRampWidth = 200, kRampHeight = 100;
constexpr double kExposures_s[] = {0.01, 0.03, 0.1, 0.25, 1};

double RampRadiance(int column) { return 0.1 * std::exp2(10.0 * (column + 0.5) / kRampWidth); }

std::vector<std::string> TakeRamp(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  for (const double exposure_s : kExposures_s) {
    cv::Mat picture(kRampHeight, kRampWidth, CV_16UC1);
    for (int row = 0; row < kRampHeight; ++row)
      for (int column = 0; column < kRampWidth; ++column) {
        core::Random random(7, files.size(), static_cast<std::uint32_t>(row * kRampWidth + column));
        const double full = 20000,
                     electrons = random.Poisson(full * exposure_s * RampRadiance(column)) +
                                 6 * random.Normal(),
                     y = std::pow(std::clamp(electrons / full, 0.0, 1.0), 0.6);
        picture.at<std::uint16_t>(row, column) =
            static_cast<std::uint16_t>(std::lround(65535 * y / (y + 0.45 * (1 - y))));
      }
    files.push_back(fmt::format("ramp{}.png", files.size()));
    cv::imwrite((folder / files.back()).string(), picture);
  }
  return files;
}

// What `merge IMAGES` wrote.
class Picture {
 public:
  explicit Picture(const std::filesystem::path& path) {
    core::ExrReader file(path);
    radiance_ = file.ReadFloat(0, "Y");
    sigma_ = file.ReadFloat(0, "sigma.Y");
    mask_ = file.ReadUint(0, "mask.Y");
  }

  // Against the ramp, times the factor that its unit leaves open.
  Agreement AgainstRamp() const {
    Agreement result;
    double sum = 0;
    const auto each = [&](auto what) {
      for (std::size_t k = 0; k < mask_.size(); ++k)
        if (!mask_[k])
          what(radiance_[k], sigma_[k], RampRadiance(static_cast<int>(k % kRampWidth)));
    };
    each([&](double l, double, double truth) {
      sum += std::log(l / truth);
      ++result.texels;
    });
    result.factor = std::exp(sum / result.texels);
    each([&](double l, double sigma, double truth) {
      result.rms += std::pow(l / (result.factor * truth) - 1, 2) / result.texels;
      result.chi_squared += std::pow((l - result.factor * truth) / sigma, 2) / result.texels;
    });
    result.rms = std::sqrt(result.rms);
    return result;
  }

 private:
  std::vector<float> radiance_, sigma_;
  std::vector<std::uint32_t> mask_;
};

TEST_F(Calibrate, ResponseAndPictures) {
  const std::vector<std::string> files = TakeRamp(folder_);
  const auto with_pictures = [&](std::vector<std::string> arguments,
                                 const std::vector<std::string>& options) {
    arguments.insert(arguments.end(), files.begin(), files.end());
    arguments.insert(arguments.end(), options.begin(), options.end());
    return Run(arguments);
  };
  const std::string times = "0.01,0.03,0.1,0.25,1";
  const Json json = with_pictures({"calibrate", "response"}, {"-o", "r.cal.json", "--exposure",
                                                              times, "--report", "response.html"});
  EXPECT_EQ(json.at("bits"), 16);
  EXPECT_EQ(json.at("method"), "debevec");
  EXPECT_EQ(json.at("exposures_s").size(), 5u);
  const std::string page = Page("response.html");
  for (const char* part : {"16 bit, 5 pictures of 0.01 s to 1 s, method debevec",
                           "Standard error of the exposure", "grey, noise"})
    ExpectHolds(page, part);
  const Json& channel = json.at("channels").at(0);
  ExpectHolds(page, fmt::format("{:.3g} of {:.0f}", channel.at("fit_chi_squared").get<double>(),
                                channel.at("fit_degrees").get<double>()));

  with_pictures({"merge"}, {"-o", "scene.exr", "--exposure", times, "--calibration", "r.cal.json"});
  const Picture scene(folder_ / "scene.exr");
  const Agreement merged = scene.AgainstRamp();
  std::printf("  radiance is off by %.3f %% rms, chi^2 %.3f of %g pixels\n", 100 * merged.rms,
              merged.chi_squared, merged.texels);
  EXPECT_GT(merged.texels, 0.95 * kRampWidth * kRampHeight);
  EXPECT_LT(merged.rms, 0.02);
  // The curve's error is common to all pixels: a handful of independent ones.
  EXPECT_NEAR(merged.chi_squared, 1, 0.4);

  // The third picture's time believed to be a tenth longer than it was.
  const std::string wrong = "0.01,0.03,0.11,0.25,1";
  with_pictures({"merge"}, {"-o", "wrong.exr", "--exposure", wrong, "--calibration", "r.cal.json"});
  const Json estimate =
      with_pictures({"merge"}, {"-o", "estimated.exr", "--exposure", wrong, "--calibration",
                                "r.cal.json", "--estimate-exposures"});
  const double stated = Picture(folder_ / "wrong.exr").AgainstRamp().rms,
               estimated = Picture(folder_ / "estimated.exr").AgainstRamp().rms;
  std::printf("  with a wrong time %.3f %%, with it estimated %.3f %%\n", 100 * stated,
              100 * estimated);
  EXPECT_GT(stated, 2 * merged.rms);
  EXPECT_LT(estimated, 1.05 * merged.rms);
  const Json& third = estimate.at("exposures").at(2);
  EXPECT_TRUE(third.at("known").get<bool>());
  EXPECT_EQ(third.at("nominal_s"), 0.11);
  // The curve is of the same pictures, and its error no part of the ratio's: 0.1 % for it.
  EXPECT_NEAR(third.at("estimated_s").get<double>(), 0.1,
              4.5 * third.at("sigma_s").get<double>() + 1e-4);
}

}  // namespace
}  // namespace luxfield::e2e
