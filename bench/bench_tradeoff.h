// `luxfield bench tradeoff`: error against time for every estimator and its knobs, over whole
// scenes, with and without shadows, on diffuse and glossy surfaces.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchTradeoffOptions {
  std::vector<std::filesystem::path> scenes{"data/scenes/garage.toml", "data/scenes/wall.toml",
                                            "data/scenes/street.toml", "data/scenes/hall.toml"};
  std::vector<std::string> estimators;              // empty: all
  std::vector<int> samples_per_pixel{16, 64, 256};  // over all luminaires of a scene
  int width = 128, height = 96;                     // of the pictures
  int reference_samples = 4096;                     // per pixel, both halves together
  std::string device;                               // as --device
  int threads = 0;                                  // of an OpenCL CPU device, 0: all
};

// Rows {"scene", "shadows", "surface", "estimator", "spp", "knobs", "width", "height", "images",
// "channels", "threads", "build_core_s", "fps", "core_s", "rel_rmse", "rel_mse", "mean_lab",
// "bias", "reference_rel_rmse", "resolved", "pareto"}, one per estimator and setting.
//
// shadows is "on" or "off"; rays are traced unless knobs name shadow maps, which are cast
// beforehand and not timed (bench_shadows.h does). surface is "glossy" for the scene as it is and
// "diffuse" for the same with Lambertian materials; a scene without glossy materials has diffuse
// rows only. spp is 0 where no samples are taken. fps and core_s time the lighting of a resident
// G-buffer after compilation, the best of up to three runs; build_core_s is the CPU time of the
// tables that the estimator asks for. Errors are of the picture's radiance (core/measures.h).
//
// References, and errors against them: planning/reference_picture.h. reference_rel_rmse is the
// reference's own; `resolved` says whether the row's error is ten times that or more
// (docs/theory.md 10).
//
// Throws InputError (an unknown estimator, a scene or lamp that is not there), DeviceError,
// Interrupted.
nlohmann::json BenchTradeoff(const BenchTradeoffOptions& options = {});

// Sets "pareto" in every row: no other row of the same scene, shadows and surface has at most its
// core_s and at most its rel_rmse, and less of one.
void MarkPareto(nlohmann::json& rows);

}  // namespace luxfield::bench
