// luxfield bench NAME: the commands behind docs/performance.md.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include "cli/program.h"
#include "cli/tradeoff_report.h"
#include "core/file.h"
#include "core/parallel.h"
#include "render/device.h"
#include "study/bench_accuracy.h"
#include "study/bench_errors.h"
#include "study/bench_nearfield.h"
#include "study/bench_sampling.h"
#include "study/bench_scale.h"
#include "study/bench_shadows.h"
#include "study/bench_solve.h"
#include "study/bench_tradeoff.h"
#include "study/cost_model.h"
#include "study/thesis_table.h"

namespace luxfield::cli {
namespace {

// Rows as an aligned table: numbers to four digits; lists are for --json. `columns` empty: all of
// the first row's.
void PrintRows(const core::Json& rows, const std::vector<std::string>& columns) {
  if (rows.empty()) return;
  std::vector<std::vector<std::string>> cells{columns};
  if (columns.empty())
    for (const auto& [key, value] : rows.front().items())
      if (!value.is_structured()) cells[0].push_back(key);
  for (const auto& row : rows) {
    cells.emplace_back();
    for (const auto& key : cells[0]) {
      const auto it = row.find(key);
      if (it == row.end())
        cells.back().emplace_back("");
      else if (it->is_number_float())
        cells.back().push_back(fmt::format("{:.4g}", it->get<double>()));
      else
        cells.back().push_back(it->is_string() ? it->get<std::string>() : it->dump());
    }
  }
  for (const auto& row : cells) {
    for (std::size_t column = 0; column < row.size(); ++column) {
      std::size_t width = 0;
      for (const auto& other : cells) width = std::max(width, other[column].size());
      fmt::print("{}{:<{}}", column ? "  " : "", row[column], width);
    }
    fmt::print("\n");
  }
}

// The processor, as a bench on host threads names its device.
std::string CpuName() {
  std::istringstream lines(core::ReadFile("/proc/cpuinfo"));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown CPU";
}

core::Json Finish(const core::Json& rows, const std::string& device,
                  const std::vector<std::string>& columns = {}) {
  PrintRows(rows, columns);
  return {{"rows", rows}, {"device", device}, {"threads", core::Threads()}};
}

// Measures the cost model, stores it and shows how well it fits.
core::Json Calibrate(const std::string& device_name, int threads) {
  const auto device = render::Device::Open(device_name, threads);
  std::vector<study::CalibrationRun> runs;
  const auto model = study::Calibrate(device, &runs);
  const auto file = study::StoreCostModel(device, model);
  core::Json rows = core::Json::array();
  for (const auto& run : runs)
    rows.push_back({{"estimator", run.estimator},
                    {"pixels", run.work.pixels},
                    {"images", run.work.images / std::max(run.work.pixels, 1.0)},
                    {"texels", run.work.texels / std::max(run.work.pixels, 1.0)},
                    {"spp", run.work.samples / std::max(run.work.pixels, 1.0)},
                    {"rays", run.work.rays / std::max(run.work.pixels, 1.0)},
                    {"measured_s", run.measured_s},
                    {"predicted_s", run.predicted_s}});
  if (file.empty())
    fmt::print(stderr, "the model cannot be stored: no cache folder can be written\n");
  else
    fmt::print("stored in {}\n", file.string());
  return Finish(rows, device.info().name);
}

// Error against time, with its CSV and plots.
core::Json Tradeoff(const study::BenchTradeoffOptions& how, const std::filesystem::path& folder) {
  const core::Json rows = study::BenchTradeoff(how);
  const auto files = WriteTradeoff(rows, folder);
  core::Json result =
      Finish(rows, render::Device::Open(how.device, how.threads).info().name,
             {"scene", "shadows", "surface", "estimator", "spp", "knobs", "core_s", "fps",
              "build_core_s", "rel_rmse", "rel_mse", "mean_lab", "bias", "resolved", "pareto"});
  for (const auto& file : files) fmt::print("{}\n", file.string());
  study::ThesisTableOptions thesis;
  thesis.device = how.device;
  thesis.threads = how.threads;
  result["thesis"] = study::ThesisTable(thesis);
  PrintRows(result["thesis"], {"what", "unit", "thesis", "ours", "how"});
  return result;
}

// Whether errors asked for are kept, with the two figures that the rows add up to.
core::Json Accuracy(const study::BenchAccuracyOptions& how) {
  const core::Json rows = study::BenchAccuracy(how);
  core::Json result =
      Finish(rows, render::Device::Open(how.device, how.threads).info().name,
             {"scene", "shadows", "asked", "estimated", "true", "kept", "estimator", "spp",
              "lighting_s", "best_fixed", "best_fixed_spp", "best_fixed_s", "time_ratio"});
  int kept = 0;
  std::vector<double> ratios;
  for (const auto& row : rows) {
    kept += row["kept"].get<bool>() ? 1 : 0;
    ratios.push_back(row["time_ratio"]);
  }
  std::sort(ratios.begin(), ratios.end());
  const auto within = std::upper_bound(ratios.begin(), ratios.end(), 2.0) - ratios.begin();
  fmt::print(
      "within the error asked for: {} of {}; within twice the best fixed setting's time: {} of {}, "
      "median {:.2f}\n",
      kept, rows.size(), within, rows.size(), ratios[ratios.size() / 2]);
  result["kept"] = kept;
  result["within_twice_the_time"] = within;
  return result;
}

struct Options {
  std::string name, lab = "data/labs/small.toml", plan = "data/plans/small.toml", folder, device;
  int seeds = 20;
  std::vector<int> samples;
  std::vector<std::string> scenes, estimators;
  std::optional<int> width, height, reference_samples;
};

study::BenchTradeoffOptions TradeoffOptions(const Options& options, int threads) {
  study::BenchTradeoffOptions how;
  how.device = options.device;
  how.threads = threads;
  how.estimators = options.estimators;
  if (!options.scenes.empty()) how.scenes.assign(options.scenes.begin(), options.scenes.end());
  if (!options.samples.empty()) how.samples_per_pixel = options.samples;
  how.width = options.width.value_or(how.width);
  how.height = options.height.value_or(how.height);
  how.reference_samples = options.reference_samples.value_or(how.reference_samples);
  return how;
}

}  // namespace

void AddBench(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "bench", "Measure luxfield itself, or this machine", [options, &program]() -> core::Json {
        if (options->name == "solve") return Finish(study::BenchSolve({}), CpuName());
        if (options->name == "calibrate")
          return Calibrate(options->device, program.common().threads);
        if (options->name == "nearfield") {
          study::BenchNearfieldOptions how;
          how.device = options->device;
          how.threads = program.common().threads;
          how.width = options->width.value_or(how.width);
          how.height = options->height.value_or(how.height);
          if (!options->samples.empty()) how.samples_per_pixel = options->samples;
          how.estimators = options->estimators;
          return Finish(study::BenchNearfield(how),
                        render::Device::Open(how.device, how.threads).info().name);
        }
        if (options->name == "accuracy") {
          study::BenchAccuracyOptions how;
          how.device = options->device;
          how.threads = program.common().threads;
          how.width = options->width.value_or(how.width);
          how.height = options->height.value_or(how.height);
          how.seed = program.common().seed.value_or(1);
          how.reference_samples = options->reference_samples.value_or(how.reference_samples);
          if (options->scenes.empty())
            how.scenes = study::BenchTradeoffOptions{}.scenes;
          else
            how.scenes.assign(options->scenes.begin(), options->scenes.end());
          return Accuracy(how);
        }
        if (options->name == "scale") {
          study::BenchScaleOptions how;
          how.device = options->device;
          how.threads = program.common().threads;
          how.estimators = options->estimators;
          if (!options->samples.empty()) how.samples_per_pixel = options->samples.front();
          return Finish(study::BenchScale(how),
                        render::Device::Open(how.device, how.threads).info().name);
        }
        if (options->name == "tradeoff")
          return Tradeoff(TradeoffOptions(*options, program.common().threads),
                          options->folder.empty() ? "out/tradeoff" : options->folder);
        if (options->name == "sampling") {
          study::BenchSamplingOptions how;
          how.device = options->device;
          how.threads = program.common().threads;
          return Finish(study::BenchSampling(how),
                        render::Device::Open(how.device, how.threads).info().name);
        }
        if (options->name == "shadows") {
          study::BenchShadowsOptions how;
          how.device = options->device;
          how.threads = program.common().threads;
          how.width = options->width.value_or(how.width);
          how.height = options->height.value_or(how.height);
          how.reference_samples = options->reference_samples.value_or(how.reference_samples);
          if (!options->estimators.empty()) how.estimators = options->estimators;
          if (!options->samples.empty()) how.samples_per_pixel = options->samples;
          how.pictures = options->folder;
          return Finish(study::BenchShadows(how),
                        render::Device::Open(how.device, how.threads).info().name);
        }
        study::BenchErrorsOptions how;
        how.lab = options->lab;
        how.plan = options->plan;
        how.folder = options->folder.empty()
                         ? std::filesystem::temp_directory_path() /
                               fmt::format("luxfield-bench-errors-{}", ::getpid())
                         : std::filesystem::path(options->folder);
        how.seeds = options->seeds;
        how.seed = program.common().seed.value_or(1);
        const core::Json rows = study::BenchErrors(how);
        if (options->folder.empty()) std::filesystem::remove_all(how.folder);
        return Finish(rows, CpuName());
      });
  verb.add_option(
          "NAME", options->name,
          "solve: the Gram solve against a memory copy; nearfield: estimators against closed form "
          "and time;\n"
          "sampling: what it costs to draw a light sample;\n"
          "shadows: shadow maps and traced shares against traced samples;\n"
          "errors: does the propagated sigma of C hold, and what each systematic error does;\n"
          "tradeoff: error against time for every estimator and knob, over the scenes of `./run "
          "lamps`;\n"
          "calibrate: what estimators cost on a device, stored for render --error and --time;\n"
          "accuracy: are errors asked for kept, and at which time against the best fixed setting;\n"
          "scale: time and memory against images, resolution and receivers")
      ->required()
      ->check(CLI::IsMember({"solve", "nearfield", "sampling", "shadows", "errors", "tradeoff",
                             "calibrate", "accuracy", "scale"}));
  verb.add_option("--lab", options->lab, "errors: the lab.toml whose [errors.*] state the sizes");
  verb.add_option("--plan", options->plan, "errors: the plan.toml");
  verb.add_option(
      "--folder", options->folder,
      "errors: scratch folder (default: a temporary one); tradeoff: where CSV and plots go "
      "(default: out/tradeoff); shadows: where pictures go (default: nowhere)");
  verb.add_option("--seeds", options->seeds, "errors: sessions with random sources alone")
      ->check(CLI::Range(2, 10000));
  verb.add_option(
      "--scene", options->scenes,
      "tradeoff, accuracy: scene.toml files (default: garage, wall, street, hall of data/scenes)");
  verb.add_option("--estimator", options->estimators,
                  "nearfield, tradeoff, shadows: estimators (default: all; all; exact windowed)");
  verb.add_option("--reference-spp", options->reference_samples,
                  "tradeoff, shadows: samples per pixel of sampled references (default: 4096)")
      ->check(CLI::Range(2, 1 << 24));
  verb.add_option("--spp", options->samples,
                  "nearfield, tradeoff, shadows: samples per pixel to try (default: 50 200; 50 200 "
                  "1000; 16 50 200)");
  verb.add_option("--width", options->width,
                  "nearfield, tradeoff, shadows: picture width, pixels (default: 1024; 128; 256)")
      ->check(CLI::Range(1, 16384));
  verb.add_option("--height", options->height,
                  "nearfield, tradeoff, shadows: picture height, pixels (default: 768; 96; 192)")
      ->check(CLI::Range(1, 16384));
  verb.add_option("--device", options->device,
                  "nearfield, sampling, tradeoff, shadows, calibrate: OpenCL device (default: the "
                  "first)");
}

}  // namespace luxfield::cli
