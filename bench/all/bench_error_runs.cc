#include "luxfield/bench/all/bench_error_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "luxfield/bench/all/process.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Keeps cores busy until it goes away.
class Load {
 public:
  explicit Load(int threads) {
    for (int k = 0; k < threads; ++k)
      threads_.emplace_back([this](const std::stop_token& stop) {
        for (std::uint64_t x = 1; !stop.stop_requested(); x = 6364136223846793005u * x + 1)
          computed_.store(x, std::memory_order_relaxed);
      });
  }

 private:
  std::atomic<std::uint64_t> computed_{0};
  std::vector<std::jthread> threads_;
};

std::vector<std::string> Words(const ErrorRunsOptions& options, int run) {
  std::vector<std::string> words{LuxfieldProgram(),
                                 "render",
                                 fs::absolute(options.scene),
                                 "--error",
                                 options.error,
                                 "--seed",
                                 std::to_string(options.seed + static_cast<std::uint64_t>(run)),
                                 "-o",
                                 options.folder / "picture.exr",
                                 "--json",
                                 options.folder / "picture.json",
                                 "--quiet"};
  const auto add = [&](const char* option, int value) {
    if (value > 0) words.insert(words.end(), {option, std::to_string(value)});
  };
  add("--width", options.width);
  add("--height", options.height);
  add("--threads", options.threads);
  if (!options.device.empty()) words.insert(words.end(), {"--device", options.device});
  return words;
}

json RunOnce(const ErrorRunsOptions& options, int run) {
  const ProcessRun spent = RunProcess(Words(options, run), options.folder);
  const json accuracy = json::parse(core::ReadFile(options.folder / "picture.json"))["accuracy"];
  return {{"run", run + 1},
          {"estimator", accuracy.at("estimator")},
          {"spp", accuracy.at("spp")},
          {"wall_s", spent.wall_s},
          {"core_s", spent.core_s},
          {"estimated", accuracy.at("estimated_rel_rmse")}};
}

}  // namespace

std::vector<double> ErrorsAmong(const std::vector<core::Image>& pictures) {
  const auto n = static_cast<double>(pictures.size());
  const std::size_t pixels = pictures.front().data.size();
  std::vector<double> sum(pixels);
  for (const core::Image& picture : pictures)
    for (std::size_t i = 0; i < pixels; ++i) sum[i] += picture.data[i];
  double mean = 0;
  for (const double s : sum) mean += s / n / static_cast<double>(pixels);
  std::vector<double> errors;
  for (const core::Image& picture : pictures) {
    double squares = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double x = picture.data[i], off = x - (sum[i] - x) / (n - 1);
      squares += off * off;
    }
    errors.push_back(std::sqrt(squares / static_cast<double>(pixels) * (n - 1) / n) / mean);
  }
  return errors;
}

json BenchErrorRuns(const ErrorRunsOptions& options) {
  if (options.runs < 2)
    throw InputError("bench error-runs: --runs must be at least 2; errors are told by others");
  core::RequireRegularFile(options.scene);
  fs::create_directories(options.folder);
  core::Progress progress("runs", static_cast<std::uint64_t>(options.runs) + 1);
  RunOnce(options, 0);
  progress.Advance();
  const Load load(options.load);
  json rows = json::array();
  std::vector<core::Image> pictures;
  for (int run = 0; run < options.runs; ++run) {
    core::ThrowIfInterrupted();
    rows.push_back(RunOnce(options, run));
    pictures.push_back(core::LuminanceImage(core::ReadExrImage(options.folder / "picture.exr")));
    progress.Advance();
  }
  for (const char* name : {"picture.exr", "picture.json"}) fs::remove(options.folder / name);
  const std::vector<double> errors = ErrorsAmong(pictures);
  for (std::size_t k = 0; k < errors.size(); ++k) rows[k]["reached"] = errors[k];
  return rows;
}

json ErrorRunsSummary(const json& rows) {
  std::map<std::string, std::vector<double>> core_s;
  std::vector<double> all_core_s, all_wall_s;
  double worst = 0;
  for (const json& row : rows) {
    core_s[row.at("estimator")].push_back(row.at("core_s"));
    all_core_s.push_back(row.at("core_s"));
    all_wall_s.push_back(row.at("wall_s"));
    worst = std::max(worst, row.at("reached").get<double>());
  }
  json estimators;
  std::vector<double> medians;
  std::size_t most = 0;
  for (const auto& [name, times] : core_s) {
    estimators[name] = times.size();
    medians.push_back(core::Median(times));
    most = std::max(most, times.size());
  }
  const auto [least, largest] = std::minmax_element(medians.begin(), medians.end());
  return {{"runs", rows.size()},
          {"estimators", estimators},
          {"flips", rows.size() - most},
          {"flip_ratio", *largest / *least},
          {"core_s", core::Median(all_core_s)},
          {"wall_s", core::Median(all_wall_s)},
          {"worst_core_s", *std::max_element(all_core_s.begin(), all_core_s.end())},
          {"worst_reached", worst}};
}

}  // namespace luxfield::bench
