#include "ideal_rig.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/sim/simulated_lab.h"

namespace luxfield::physics {
namespace {

constexpr double kDelta_m = 0.3, kMinExposure_s = 1e-3, kMaxExposure_s = 1.1;
constexpr double kGain = 0.16, kBlack_dn = 400, kSaturation_dn = 16000;

std::string RigAndFilter(const IdealRig& rig) {
  std::string text = fmt::format("[rig]\nkind = \"{}\"\ndelta_m = {}\n",
                                 rig.corners ? "reflector" : "lensless", kDelta_m);
  if (rig.corners) text += fmt::format("albedo = {}\n", rig.albedo);
  text += fmt::format("[filter]\nkind = \"{}\"\nbasis = \"{}\"\nspacing_m = {}\n",
                      rig.dual ? "dual" : "basis", rig.basis.name(),
                      rig.spacing_px * IdealRig::kPixel_m);
  if (rig.basis.kind == lightfield::BasisKind::kQuadratic)
    text += fmt::format("basis_a = {}\n", rig.basis.a);
  if (!rig.dual) text += fmt::format("scale = {}\n", rig.filter_scale);
  return text;
}

std::string LabToml(const IdealRig& rig, const lightfield::LightField& lamp) {
  // A bound of the irradiance: nowhere is more than the brightest texel in every image.
  const double brightest = *std::max_element(lamp.data.begin(), lamp.data.end());
  const double bound =
      brightest * std::pow(rig.spacing_px * IdealRig::kPixel_m * rig.basis.TotalIntegral(), 2) *
      rig.filter_scale * (rig.dual ? 9 : 1);
  // The brightest pixel saturates at about 20 shortest exposures.
  const double responsivity = kSaturation_dn / (kGain * 20 * kMinExposure_s * bound);
  std::string camera;
  if (rig.corners) {
    const double x = 0.5 * rig.sensor_width * IdealRig::kPixel_m,
                 y = 0.5 * rig.sensor_height * IdealRig::kPixel_m;
    for (const auto& corner : *rig.corners)
      camera += fmt::format("{}{}, {}", camera.empty() ? "corners_m = [" : ", ", x * corner.x,
                            y * corner.y);
    camera += "]\n";
  } else {
    camera = fmt::format("pitch_m = {}\n", IdealRig::kPixel_m / rig.resolution);
  }
  std::string responsivities;
  for (int channel = 0; channel < rig.channels; ++channel)
    responsivities += fmt::format("{}{}", channel ? ", " : "", responsivity * (1 - 0.2 * channel));
  return fmt::format(
      "[lab]\ndriver = \"sim\"\nideal = true\nchannels = {}\n{}"
      "[lamp]\nkind = \"lightfield\"\nfile = \"truth.lf.exr\"\n"
      "[camera]\nwidth = {}\nheight = {}\n{}bits = 14\nblack_dn = {}\nsaturation_dn = {}\n"
      "gain_dn_per_e = {}\nresponsivity_e_per_s_per_w_m2 = [{}]\nmin_exposure_s = {}\n"
      "max_exposure_s = {}\n"
      "[stage]\nmin_m = [-0.2, -0.2]\nmax_m = [0.2, 0.2]\n",
      rig.channels, RigAndFilter(rig), rig.sensor_width * rig.resolution,
      rig.sensor_height * rig.resolution, camera, kBlack_dn, kSaturation_dn, kGain, responsivities,
      kMinExposure_s, kMaxExposure_s);
}

std::string PlanToml(const IdealRig& rig) {
  return fmt::format(
      "[plan]\nunit = \"lm\"\nchannels = {}\ndark_repeats = 1\n{}"
      "[grid]\nwidth = {}\nheight = {}\n"
      "[lattice]\nwidth = {}\nheight = {}\nds_m = {}\n"
      "[exposure]\nmin_s = {}\nmax_s = {}\nratio = 4\n",
      rig.channels, RigAndFilter(rig), rig.grid_width, rig.grid_height, rig.lattice_width,
      rig.lattice_height, rig.texel_px * IdealRig::kPixel_m, kMinExposure_s, kMaxExposure_s);
}

}  // namespace

lightfield::LuminaireGeometry IdealRig::Geometry() const {
  const double texel_m = texel_px * kPixel_m;
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = kDelta_m;
  geometry.grid =
      lightfield::BasisGrid::Centred(basis, grid_width, grid_height, spacing_px * kPixel_m);
  geometry.lattice = {
      lattice_width, lattice_height, -0.5 * lattice_width * texel_m, 0.5 * lattice_height * texel_m,
      texel_m,       texel_m};
  geometry.channels = channels;
  geometry.unit = lightfield::FluxUnit::kLumen;
  return geometry;
}

lightfield::LightField StructuredLamp(const IdealRig& rig, std::uint64_t seed) {
  lightfield::LightField field(rig.Geometry());
  const int width = rig.lattice_width, height = rig.lattice_height;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (int channel = 0; channel < rig.channels; ++channel) {
      core::Random random(seed, static_cast<std::uint64_t>(m * 3 + channel));
      const double x = width * (0.2 + 0.6 * random.Uniform()),
                   y = height * (0.2 + 0.6 * random.Uniform());
      auto image = field.image(m, channel);
      for (int row = 0; row < height; ++row)
        for (int column = 0; column < width; ++column) {
          const double distance = std::hypot(column + 0.5 - x, row + 0.5 - y) / (0.5 * width);
          const double decades = -5.5 * std::min(1.0, distance + 0.3 * random.Uniform());
          image[static_cast<std::size_t>(row) * width + column] =
              static_cast<float>(1e6 * std::pow(10, decades));
        }
    }
  return field;
}

lightfield::LightField FlatLamp(const IdealRig& rig, double c, std::uint64_t seed) {
  lightfield::LightField field(rig.Geometry());
  core::Random random(seed, 0);
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (int channel = 0; channel < rig.channels; ++channel) {
      auto image = field.image(m, channel);
      std::fill(image.begin(), image.end(), static_cast<float>(c * (0.5 + random.Uniform())));
    }
  return field;
}

IdealRun RunIdeal(const IdealRig& rig, const lightfield::LightField& lamp) {
  const auto folder = std::filesystem::path(testing::TempDir()) /
                      fmt::format("luxfield_ideal_{}_{}", rig.name, getpid());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  IdealRun run;
  run.truth_file = folder / "truth.lf.exr";
  run.reconstructed_file = folder / "chain.signed.lf.exr";
  lightfield::WriteLightField(run.truth_file, lamp);
  planning::ChainOptions options;
  options.lab = folder / "lab.toml";
  options.plan = folder / "plan.toml";
  options.folder = folder;
  options.keep_session = false;
  core::WriteFileAtomically(options.lab, LabToml(rig, lamp));
  core::WriteFileAtomically(options.plan, PlanToml(rig));
  run.chain = planning::RunChain(options);
  run.true_irradiance = hal::sim::SimulatedLab(options.lab).true_irradiance(lamp.geometry);
  return run;
}

}  // namespace luxfield::physics
