// Small simulated labs for tests.
#pragma once

#include <fmt/format.h>

#include <string>

#include "luxfield/core/config.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::hal::sim {

struct TestLab {
  std::string lab = "ideal = true";  // more of [lab]
  std::string rig = "kind = \"lensless\"";
  std::string filter = "spacing_m = 0.02";
  std::string lamp = "kind = \"square\"\nside_m = 0.06\ndepth_m = 0.03\nradiance = 1000";
  std::string camera = "pitch_m = 0.01\nwidth = 32\nheight = 24";
  std::string errors;  // whole tables [errors.x]

  std::string Toml() const {
    return fmt::format(
        "[lab]\ndriver = \"sim\"\nname = \"test lab\"\n{}\n[rig]\ndelta_m = "
        "0.25\n{}\n[filter]\n{}\n[lamp]\n{}\n"
        "[camera]\n{}\nbits = 12\nblack_dn = 100\nsaturation_dn = 4000\ngain_dn_per_e = 0.5\n"
        "responsivity_e_per_s_per_w_m2 = [1000]\nmin_exposure_s = 1e-4\nmax_exposure_s = 10\n"
        "[stage]\nmin_m = [-0.1, -0.1]\nmax_m = [0.1, 0.1]\nspeed_m_per_s = 0.05\nsettle_s = "
        "0.5\n{}\n",
        lab, rig, filter, lamp, camera, errors);
  }
  core::Config Config() const { return core::Config::FromString(Toml(), "lab.toml"); }
};

// A light field in the span of bspline2 with structure in s and u.
inline lightfield::LightField StructuredField(int width, int height, int lattice, double texel_m,
                                              double spacing_m, std::uint64_t seed) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.25;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), width, height, spacing_m);
  geometry.lattice = {lattice, lattice, -0.5 * lattice * texel_m, 0.5 * lattice * texel_m,
                      texel_m, texel_m};
  lightfield::LightField field(geometry);
  core::Random random(seed, 0);
  for (float& c : field.data) c = static_cast<float>(1000 * random.Uniform());
  return field;
}

}  // namespace luxfield::hal::sim
