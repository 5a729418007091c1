// A lab and a plan whose capture takes no time: lensless, 8 x 8 images of a square lamp.
#pragma once

#include <fmt/format.h>

#include <string>

namespace luxfield::e2e {

inline constexpr const char* kTinyRig = R"([rig]
kind = "lensless"
delta_m = 0.25
[filter]
spacing_m = 0.02
)";

// `speed` of the stage in m/s, `settle` in s.
inline std::string TinyLab(double speed, double settle) {
  return fmt::format(R"([lab]
driver = "sim"
seed = 5
{}[lamp]
kind = "square"
side_m = 0.06
depth_m = 0.03
radiance = 1000
[camera]
pitch_m = 0.01
width = 32
height = 24
bits = 12
black_dn = 100
saturation_dn = 4000
gain_dn_per_e = 0.5
responsivity_e_per_s_per_w_m2 = [1000]
min_exposure_s = 1e-4
max_exposure_s = 10
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = {}
settle_s = {}
[errors.photon_noise]
[errors.read_noise]
rms_dn = 2
)",
                     kTinyRig, speed, settle);
}

inline std::string TinyPlan(int width, int height) {
  return fmt::format(R"([plan]
dark_repeats = 1
{}[grid]
width = {}
height = {}
[lattice]
width = 8
height = 8
ds_m = 0.02
[exposure]
min_s = 0.01
max_s = 3
ratio = 4
relevant_share = 0.01
[reference]
every = 4
max_drift = 0.05
[warm_up]
window_s = 10
interval_s = 1
)",
                     kTinyRig, width, height);
}

}  // namespace luxfield::e2e
