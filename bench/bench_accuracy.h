// `luxfield bench accuracy`: does `render --error` keep its word, and what does it cost against the
// best fixed setting?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/render/accuracy/cost_model.h"

namespace luxfield::bench {

struct BenchAccuracyOptions {
  std::vector<std::filesystem::path> scenes;
  // Relative RMSE of the luminance.
  std::vector<double> targets{0.05, 0.02, 0.01, 0.005};
  std::vector<double> shadowed_targets{0.1, 0.05, 0.03, 0.02};
  int seeds = 3;
  std::uint64_t seed = 1;  // of the first run
  int width = 160, height = 120;
  // At most, per pixel; fewer where the reference is good enough for the least target.
  int reference_samples = 1 << 14;
  std::optional<render::CostModel> costs;  // measured where none is given
  std::string device;
  int threads = 0;
};

// Rows [{"scene", "shadows", "surface", "asked", "seed", "estimated", "true", "kept", "resolved",
// "met", "estimator", "spp", "core_s", "lighting_s", "choosing_s", "best_fixed", "best_fixed_spp",
// "best_fixed_core_s", "time_ratio", "reference_error"}], of every scene with and without shadows,
// as it is ("glossy") and with Lambertian materials ("diffuse").
//
// `true` is the relative RMSE of the picture's luminance against planning/reference_picture.h,
// whose own is reference_error; `resolved` says that the latter is at most a fifth of `asked`.
// `kept`:
// `true` is within what was asked. `met`: the renderer says so of itself.
//
// core_s is the CPU time of lighting the picture that is handed out, with that of the tables which
// only this view can use (light-vector volumes); those of the lamp are made before. best_fixed is
// the estimator and number of samples, in one pass, whose core_s is least among those whose true
// error, RMS over four seeds, is within the target by a sweep over sample counts, interpolated
// between them: a setting that nobody can know beforehand. time_ratio = core_s / best_fixed_core_s,
// null where no setting of the sweep gets there. choosing_s is the wall time of the pilots, spent
// before.
//
// Throws InputError, DeviceError, Interrupted.
nlohmann::json BenchAccuracy(const BenchAccuracyOptions& options);

// {"resolved", "kept" (of the resolved rows), "unresolved", "timed" (rows with a time_ratio),
// "within_twice_the_time", "median_time_ratio", "worst_time_ratio"} (0 where none is timed).
nlohmann::json AccuracySummary(const nlohmann::json& rows);

}  // namespace luxfield::bench
