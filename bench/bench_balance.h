// `luxfield bench balance`: what it is worth to choose, for every pixel and light, how many samples
// follow the light and how many the BRDF (docs/theory.md 9).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchBalanceOptions {
  std::vector<std::filesystem::path> scenes{"data/scenes/balance/five-lights.toml",
                                            "data/scenes/balance/serpent-sun-behind.toml",
                                            "data/scenes/balance/serpent-sun-front.toml",
                                            "data/scenes/balance/occluded-ground.toml",
                                            "data/scenes/balance/plates.toml",
                                            "data/scenes/balance/near-plates.toml",
                                            "data/scenes/balance/diffuse.toml",
                                            "data/scenes/balance/mirror.toml",
                                            "data/scenes/balance/mixed.toml",
                                            "data/scenes/balance/corner.toml",
                                            "data/scenes/balance/noon-balls.toml"};
  int width = 64, height = 48;
  int samples_per_light = 256;    // per pixel
  int pilot = 64;                 // of them, where a share is chosen
  int seeds = 8;                  // pictures of each strategy, at least 4
  int reference_samples = 16000;  // per pixel and light
  bool shadows = true;
  bool search = true;  // shares of the light by search, the same for all pixels and for each
  std::string device;  // as --device
  int threads = 0;     // of an OpenCL CPU device, 0: all
};

// An object of rows:
//
// "rows", for each scene and strategy (balance, power, maximum, light_only, brdf_only,
// alpha_second_order, alpha_newton, alpha_lobe): "scene", "strategy", "spp", "rel_variance", the
// mean over the pixels that hit something of var / (b^2 + eps), var the variance of the luminance
// over seeds, b the reference, eps = (0.01 mean b)^2; its standard error over seeds
// "rel_variance_se"; "mean_lab", against the reference; "core_s" and "wall_s", the least of
// lighting; "samples_per_s" of wall time; "efficiency" = 1 / (rel_variance core_s) and
// "rel_efficiency", of which that of balance is 1; and at the time that balance takes, the samples
// scaled by measured time: "equal_time_spp", "equal_time_rel_variance", "equal_time_lab".
// "reference_rel_rmse" is the reference's own error.
//
// "search": "scene", "rel_variance" of the best share of all pixels alike ("best_share"), of the
// best of each pixel and light ("of_each_pixel", chosen on half of the seeds by the variance over
// 3 x 3 pixels and judged on the other); of Newton's shares known beforehand from 1024 pilot
// samples
// ("known", and "known_rest" with the samples that a pilot leaves); beside "second_order", "newton"
// and "lobe". Newton steps lose what tells "newton" from "known": by the samples that a pilot takes
// ("known_rest"), by its noise and by cutting the sequences in two.
//
// "claims": the thesis' efficiency better than balance, power and maximum on every scene: "scene",
// "strategy" (alpha_newton, alpha_lobe), "over_balance", "over_power", "over_maximum", its
// rel_efficiency over theirs, their standard errors "..._se", and "holds".
//
// "steps": whether Newton steps are worse than the second-order formula, for each scene and the
// mean over "all": "newton_over_second_order", the ratio of their relative variances less 1, its
// standard error "se" over seeds, whose random numbers both share, "z" and "holds", z < 3.
//
// Throws InputError, DeviceError.
nlohmann::json BenchBalance(const BenchBalanceOptions& options = {});

}  // namespace luxfield::bench
