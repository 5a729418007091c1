// A Lambertian square of two spacings on an ideal bench, and a wall that it lights.
#pragma once

namespace luxfield::planning {

inline constexpr const char* kSquareLab = R"([lab]
driver = "sim"
ideal = true
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
kind = "basis"
basis = "bspline2"
spacing_m = 0.033
[lamp]
kind = "square"
side_m = 0.066
radiance = 1e5
[camera]
width = 72
height = 72
pitch_m = 0.011
bits = 14
saturation_dn = 16000
responsivity_e_per_s_per_w_m2 = [1200]
min_exposure_s = 1e-6
max_exposure_s = 10
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
[sampling]
u_per_cell = 12
)";

inline constexpr const char* kSquarePlan = R"([plan]
name = "square"
unit = "lm"
channels = 1
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
kind = "basis"
basis = "bspline2"
spacing_m = 0.033
[grid]
width = 6
height = 6
[lattice]
width = 24
height = 24
ds_m = 0.022
[exposure]
min_s = 1e-4
max_s = 0.1
ratio = 4
[reference]
every = 10
max_drift = 0.5
[warm_up]
window_s = 5
interval_s = 1
variation = 0.5
)";

// A wall 2 m ahead, seen beside the lamp, and a box before it.
inline constexpr const char* kWallScene = R"([camera]
position = [0.6, -0.2, 0.3]
look_at = [0, 2, 0]
vertical_fov_deg = 30
width = 40
height = 30
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[quad]]
corner = [-3, 2, -3]
edge_u = [6, 0, 0]
edge_v = [0, 0, 6]
material = "grey"
[[box]]
size = [0.1, 0.1, 0.3]
position = [0, 1.5, 0]
material = "grey"
[[luminaire]]
name = "lamp"
file = "none.lf.exr"
position = [0, 0, 0]
look_at = [0, 1, 0]
)";

}  // namespace luxfield::planning
