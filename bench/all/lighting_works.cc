#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "luxfield/bench/all/work.h"
#include "luxfield/bench/bench_lamps.h"
#include "luxfield/bench/bench_nearfield.h"
#include "luxfield/bench/bench_sampling.h"
#include "luxfield/bench/bench_soft_shadows.h"
#include "luxfield/bench/device_limits.h"
#include "luxfield/bench/plain_cdf.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/preprocess/tables.h"
#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {
namespace {

// Pictures a second that all cores of the device give together, on a GPU by the clock.
double FramesPerSecond(const render::DeviceInfo& device, double core_s, double wall_s) {
  return device.is_cpu ? device.compute_units / core_s : 1 / wall_s;
}

std::vector<Figures> MeasureFlagship(const AllOptions& options) {
  SoftShadowsOptions how;
  how.repeats = options.runs;
  how.reference_pixels = 2000;
  how.device = options.device;
  how.threads = options.threads;
  const auto device = render::Device::Open(options.device, options.threads).info();
  const SoftShadowsFigures flagship = MeasureSoftShadows(how);
  Figures figures;
  for (const SoftShadowsTime& run : flagship.runs)
    figures.runs.push_back(FramesPerSecond(device, run.core_s, run.wall_s));
  figures.peer = "thesis, GeForce GTX 580";
  figures.peer_value = 9;
  figures.limit = fmt::format(
      "mean Lab {:.2f} against traced truth, 1.2 allowed; shadow maps are drawn in each frame, the "
      "G-buffer once, {:.2g} core-s",
      flagship.mean_lab, flagship.primary_core_s);
  return {figures};
}

struct NearfieldCase {
  std::string estimator;
  int channels = 1, repeats = 5;
};

// The rows of some runs.
std::vector<nlohmann::json> Nearfield(const AllOptions& options, const NearfieldCase& c) {
  BenchNearfieldOptions how;
  how.car2.channels = c.channels;
  how.estimators = {c.estimator};
  how.repeats = c.repeats;
  how.reference_pixels = 500;
  how.device = options.device;
  how.threads = options.threads;
  std::vector<nlohmann::json> rows;
  for (int run = 0; run < options.runs; ++run) rows.push_back(BenchNearfield(how).at(0));
  return rows;
}

Figures VolumeFigures(const AllOptions& options, int channels) {
  const auto device = render::Device::Open(options.device, options.threads);
  const double pass_s = GBufferPassSeconds(
      device,
      render::RoadGBuffer(device, BenchNearfieldOptions{}.width, BenchNearfieldOptions{}.height));
  Figures figures;
  for (const auto& row : Nearfield(options, {"volume", channels, 7})) {
    figures.runs.push_back(
        FramesPerSecond(device.info(), row["core_s"], 1 / row["fps"].get<double>()));
    figures.limit = fmt::format(
        "relative RMSE {:.2g}, 2e-3 allowed; reading the G-buffer and adding to its irradiance, "
        "{:.3g} fps",
        row["rel_rmse"].get<double>(), FramesPerSecond(device.info(), pass_s, pass_s));
  }
  return figures;
}

std::vector<Figures> MeasureVolume(const AllOptions& options) {
  return {VolumeFigures(options, 1), VolumeFigures(options, 3)};
}

std::vector<Figures> MeasureExact(const AllOptions& options) {
  const auto device = render::Device::Open(options.device, options.threads);
  const auto gbuffer =
      render::RoadGBuffer(device, BenchNearfieldOptions{}.width, BenchNearfieldOptions{}.height);
  const double least_s =
      ExactMultiplyAdds(render::SyntheticCar2(), gbuffer) / MultiplyAddsPerSecond(device);
  Figures figures;
  for (const auto& row : Nearfield(options, {"exact", 1, 1})) {
    figures.runs.push_back(row["core_s"]);
    figures.limit =
        fmt::format("its multiply-adds out of registers, {:.3g} core-s; relative RMSE {:.2g}",
                    least_s, row["rel_rmse"].get<double>());
  }
  return {figures};
}

std::vector<Figures> MeasureDraw(const AllOptions& options) {
  constexpr int kDraws = 2'000'000;
  BenchSamplingOptions how;
  how.samplers = {"windowed"};
  how.repeats = 1;
  how.device = options.device;
  how.threads = options.threads;
  const PlainCdf plain(render::SyntheticCar2(how.car2));
  Figures figures;
  std::vector<double> plain_ns;
  for (int run = 0; run < options.runs; ++run) {
    figures.runs.push_back(BenchSampling(how).at(0)["ns_per_sample"]);
    plain_ns.push_back(1e9 * plain.SecondsPerDraw(kDraws, static_cast<std::uint64_t>(run) + 1));
  }
  figures.peer = "a plain CDF over the images, which knows no windows";
  figures.peer_value = core::Median(plain_ns);
  figures.limit = "car2, drawn and added up, unlit";
  return {figures};
}

std::vector<Figures> MeasureLamps(const AllOptions& options) {
  BenchLampsOptions how;
  how.width = 256;
  how.height = 192;
  how.runs = std::max(2, options.runs);
  how.folder = options.folder;
  how.device = options.device;
  how.threads = options.threads;
  const std::vector<LampsFigures> all = BenchLamps(how);
  const LampsFigures& one = all.front();
  std::vector<Figures> figures(2);
  for (std::size_t k = 0; k < 2; ++k) {
    const LampsFigures& many = all[k + 1];
    for (const double core_s : many.core_s)
      figures[k].runs.push_back(core_s * many.relative_variance / CostAtEqualError(one));
    figures[k].peer = "one lamp";
    figures[k].peer_value = 1;
    figures[k].limit = fmt::format(
        "{} x {}: {:.3g} core-s against {:.3g}, relative variance {:.2g} against {:.2g}, {:.3g} "
        "samples a pixel where {} are asked",
        how.width, how.height, CostOf(many), CostOf(one), many.relative_variance,
        one.relative_variance, many.samples_per_pixel, how.samples_per_pixel);
  }
  return figures;
}

// One pass over the coefficients that reads them all.
double PassCoreSeconds(const lightfield::LightField& field) {
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  const core::Stopwatch stopwatch;
  std::vector<double> sums(field.data.size() / kPiece + 1);
  core::ParallelFor(field.data.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    sums[begin / kPiece] +=
        std::reduce(field.data.begin() + static_cast<std::ptrdiff_t>(begin),
                    field.data.begin() + static_cast<std::ptrdiff_t>(end), 0.0f);
  });
  return stopwatch.CoreSeconds();
}

std::vector<Figures> MeasureTables(const AllOptions& options) {
  const auto field = render::SyntheticCar2();
  std::vector<Figures> figures(2);
  std::vector<double> pass_ms;
  for (int run = 0; run < options.runs; ++run) {
    const core::Stopwatch windowed;
    preprocess::BuildTables(field, "car2", std::string(64, '0'));
    figures[0].runs.push_back(1e3 * windowed.CoreSeconds());
    const core::Stopwatch cells;
    preprocess::BuildCellTables(field, "car2");
    figures[1].runs.push_back(1e3 * cells.CoreSeconds());
    pass_ms.push_back(1e3 * PassCoreSeconds(field));
  }
  for (Figures& each : figures) {
    each.peer = "one pass over C";
    each.peer_value = core::Median(pass_ms);
    each.limit = "99 images of 256 x 256";
  }
  return figures;
}

}  // namespace

std::vector<WorkGroup> LightingWorks() {
  return {
      {{{"flagship: two headlights 11 x 9 x 256^2, shadows, 1024 x 768", "fps", 15, true}},
       MeasureFlagship},
      {{{"volume, 1 channel, 1024 x 768", "fps", 120, true},
        {"volume, RGB, 1024 x 768", "fps", 80, true}},
       MeasureVolume},
      {{{"exact, 1 channel, 1024 x 768", "core-s", 1.4}}, MeasureExact},
      {{{"windowed draw", "core-ns", 60}}, MeasureDraw},
      {{{"200 lamps in reach at equal error", "times one lamp", 4},
        {"1000 lamps in reach at equal error", "times one lamp", 4}},
       MeasureLamps},
      {{{"tables of car2, windowed", "core-ms", 25}, {"tables of car2, cells", "core-ms", 60}},
       MeasureTables},
  };
}

}  // namespace luxfield::bench
