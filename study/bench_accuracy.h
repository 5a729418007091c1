// `luxfield bench accuracy`: does `render --error` keep its word, and what does it cost against the
// best fixed setting?
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::study {

struct BenchAccuracyOptions {
  std::vector<std::filesystem::path> scenes;
  std::vector<double> targets{0.05, 0.02, 0.01, 0.005};  // relative RMSE of the luminance
  int seeds = 3;
  std::uint64_t seed = 1;  // of the first run; the reference draws with another
  int width = 160, height = 120;
  std::vector<bool> shadows{false, true};
  // Samples per pixel of the reference where no noise-free estimator gives it, in two independent
  // halves that state its error.
  int reference_samples = 8192;
  std::string device;
  int threads = 0;
};

// Rows [{"scene", "shadows", "asked", "estimated", "true", "kept", "met", "estimator", "spp",
// "lighting_s", "best_fixed", "best_fixed_spp", "best_fixed_s", "time_ratio", "reference_error"}].
// `kept`: the true error, with the reference's own error taken off in quadrature, is within what
// was asked. best_fixed is the cheapest estimator and number of samples that the same sweep found
// to meet the target with its true error, interpolated between sample counts; time_ratio =
// lighting_s / best_fixed_s. Throws InputError, DeviceError, Interrupted.
nlohmann::json BenchAccuracy(const BenchAccuracyOptions& options);

}  // namespace luxfield::study
