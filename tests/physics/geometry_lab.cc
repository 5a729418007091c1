#include "tests/physics/geometry_lab.h"

#include <fmt/format.h>

#include "luxfield/core/random.h"

namespace luxfield {

std::string RandomBench(bool reflector, std::uint64_t seed) {
  core::Random random(seed, 77);
  const auto about = [&](double spread) { return spread * (2 * random.Uniform() - 1); };
  const double delta = 0.3 + about(0.05);
  const double source = reflector ? 0.02 : 0.01;
  std::string camera, errors, targets;
  if (reflector) {
    const double side = random.Uniform() < 0.5 ? -1 : 1;  // of I: before it or behind
    camera = fmt::format(
        "width = 480\nheight = 400\nbits = 12\n[camera.lens]\nfocal_px = [620, 620]\n"
        "position_m = [{}, {}, {}]\ntarget_m = [{}, {}]\nroll_deg = {}\nblur_px = {}\n",
        0.2 + about(0.1), 0.15 + about(0.1), side * (0.7 + about(0.1)), about(0.02), about(0.02),
        about(5), 0.5 + about(0.15));
    errors = fmt::format(
        "camera_shift_m = [{}, {}, {}]\ncamera_turn_deg = [{}, {}, {}]\nfocal = {}\n"
        "distortion = [{}, {}, {}, {}]\n",
        about(0.01), about(0.01), about(0.01), about(1), about(1), about(1), about(0.02),
        about(0.15), about(0.05), about(0.002), about(0.002));
    targets =
        "board_poses = 10\nroom_irradiance = 5\n[targets.board]\ncolumns = 10\nrows = 7\n"
        "pitch_m = 0.025\n";
  } else {
    camera = "width = 480\nheight = 400\nbits = 12\npitch_m = 0.0005\n";
    errors = fmt::format("sensor_shift_m = [{}, {}]\nsensor_turn_deg = {}\n", about(0.003),
                         about(0.003), about(1));
  }
  return fmt::format(
      "[lab]\ndriver = \"sim\"\nname = \"bench {0}\"\nseed = {0}\n[rig]\nkind = \"{1}\"\n{2}"
      "delta_m = {3}\n[filter]\nspacing_m = 0.033\n[lamp]\nkind = \"square\"\nradiance = 1000\n"
      "side_m = 0.1\n[stage]\nmin_m = [-0.06, -0.06]\nmax_m = [0.06, 0.06]\nspeed_m_per_s = 0.1\n"
      "settle_s = 0.1\n[camera]\nblack_dn = 100\nsaturation_dn = 4000\ngain_dn_per_e = 0.4\n"
      "responsivity_e_per_s_per_w_m2 = [1200]\nmin_exposure_s = 1e-3\nmax_exposure_s = 10\n{4}"
      "[targets]\nsource_m = [{5}, {6}, {7}]\nsource_intensity = 1\nsource_rms_m = 3e-4\n"
      "spacer_m = {19}\nspacer_shift_m = 5e-6\n{8}[targets.mask]\ncolumns = 8\nrows = 7\n"
      "pitch_m = {20}\n"
      "[errors.photon_noise]\n[errors.read_noise]\nrms_dn = 2\n[errors.prnu]\nrms = 0.005\n"
      "[errors.vignetting]\ncorner_loss = 0.3\n[errors.stage]\nrepeatability_m = 5e-6\n"
      "[errors.geometry]\ndelta_m = {9}\nfilter_tilt_deg = [{10}, {11}]\nstage_scale = [{12}, "
      "{13}]\nstage_turn_deg = {14}\nstage_skew_deg = {15}\nstage_slope = [{16}, {17}]\n{18}",
      seed, reflector ? "reflector" : "lensless", reflector ? "albedo = 0.9\n" : "", delta, camera,
      about(source), about(source), -0.35 + about(0.03), targets, about(0.01), about(0.5),
      about(0.5), about(0.003), about(0.003), about(0.3), about(0.2), about(0.005), about(0.005),
      errors, reflector ? 0.08 : 0.06, reflector ? 0.010 : 0.006);
}

std::string WithMosaic(std::string toml) {
  const auto replace = [&](const std::string& from, const std::string& to) {
    toml.replace(toml.find(from), from.size(), to);
  };
  replace("[lab]\n", "[lab]\nchannels = 3\n");
  replace("responsivity_e_per_s_per_w_m2 = [1200]\n",
          "cfa = \"GRBG\"\nresponsivity_e_per_s_per_w_m2 = [900, 1200, 700]\n");
  return toml;
}

hal::sim::LabDescription DescribeBench(const std::string& toml) {
  return hal::sim::ReadLab(core::Config::FromString(toml, "lab.toml"), {});
}

}  // namespace luxfield
