#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "luxfield/bench/all/process.h"
#include "luxfield/bench/all/work.h"
#include "luxfield/bench/bench_merge.h"
#include "luxfield/bench/bench_solve.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {
namespace {

std::vector<Figures> MeasureSolve(const AllOptions& options) {
  BenchSolveOptions how;
  how.float_only = true;
  Figures figures;
  figures.peer = "a copy of the same bytes";
  figures.peer_value = 1;
  for (int run = 0; run < options.runs; ++run) {
    const auto row = BenchSolve(how).at(0);
    figures.runs.push_back(row["copy_ratio"]);
    figures.limit = fmt::format("{:.3g} s, {:.3g} GB/s", row["wall_s"].get<double>(),
                                row["gb_per_s"].get<double>());
  }
  return {figures};
}

std::vector<Figures> MeasureMerge(const AllOptions& options) {
  BenchMergeOptions how;
  how.grid_width = 2;
  how.grid_height = 1;
  how.folder = options.folder / "merge";
  how.keep = true;
  how.cases = {"cached"};
  std::vector<Figures> figures(2);
  for (int run = 0; run < options.runs; ++run)
    for (const auto& row : BenchMerge(how)) {
      const std::string name = row["case"];
      if (name != "cached" && name != "cached, hashes not checked") continue;
      Figures& each = figures[name == "cached" ? 0 : 1];
      each.runs.push_back(row["copy_ratio"]);
      each.peer = "a copy of the same bytes";
      each.peer_value = 1;
      each.limit = fmt::format(
          "{} positions of {} exposures of {:.3g} Mpixel, {:.4g} Mpixel/s, {:.3g} MiB",
          row["positions"].get<int>(), row["exposures"].get<int>(), row["mpix"].get<double>(),
          row["mpix_per_s"].get<double>(), row["peak_mib"].get<double>());
    }
  std::filesystem::remove_all(how.folder);
  return figures;
}

// Irradiance with noise of one part in 256 behind 99 filters.
void WriteMeasured(const std::filesystem::path& path) {
  const lightfield::LightField lamp = render::SyntheticCar2();
  lightfield::Measurements header;
  header.geometry = lamp.geometry;
  header.positions.resize(static_cast<std::size_t>(lamp.geometry.grid.count()));
  lightfield::WriteMeasurements(path, header, [&](int m) {
    core::Random random(6, static_cast<std::uint64_t>(m));
    lightfield::Measurement measured;
    for (const float c : lamp.image(m, 0)) {
      const float sigma = c / 256;
      measured.irradiance.push_back(c + sigma * static_cast<float>(random.Normal()));
      measured.sigma.push_back(sigma);
    }
    measured.count.assign(measured.irradiance.size(), 4);
    measured.mask.assign(measured.irradiance.size(), 0);
    return measured;
  });
}

std::vector<Figures> MeasureReconstruct(const AllOptions& options) {
  const auto measured = options.folder / "car2.meas.exr", solved = options.folder / "car2.lf.exr";
  WriteMeasured(measured);
  Figures figures;
  for (int run = 0; run < options.runs; ++run) {
    const ProcessRun process =
        RunProcess({LuxfieldProgram(), "reconstruct", measured, "-o", solved}, options.folder);
    figures.runs.push_back(process.core_s);
    figures.limit = fmt::format("{:.3g} MB, {:.3g} MiB resident; the solve itself, 0.01 core-s",
                                1e-6 * static_cast<double>(std::filesystem::file_size(measured)),
                                process.peak_mib);
  }
  std::filesystem::remove(measured);
  std::filesystem::remove(solved);
  return {figures};
}

}  // namespace

std::vector<WorkGroup> ReconstructionWorks() {
  const std::string copies = "copies";
  return {
      {{{"Gram solve 345 x 256^2 x 3", copies, 3}}, MeasureSolve},
      {{{"merge, cached", copies, 22}, {"merge, cached, hashes not checked", copies, 10}},
       MeasureMerge},
      {{{"reconstruct 99 images from file", "core-s", 0.4}}, MeasureReconstruct},
  };
}

}  // namespace luxfield::bench
