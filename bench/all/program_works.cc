#include <fmt/format.h>

#include <functional>

#include "luxfield/bench/all/car_field.h"
#include "luxfield/bench/all/process.h"
#include "luxfield/bench/all/work.h"
#include "luxfield/bench/hill_mesh.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kSmallMesh = 375000, kLargeMesh = 6000000;
constexpr double kMibInGib = 1024;

std::vector<std::string> Words(const AllOptions& options, std::vector<std::string> words) {
  words.insert(words.begin(), LuxfieldProgram());
  if (options.threads > 0)
    words.insert(words.end(), {"--threads", std::to_string(options.threads)});
  return words;
}

std::vector<std::string> Render(const AllOptions& options, const fs::path& scene,
                                std::vector<std::string> more) {
  std::vector<std::string> words{"render", scene, "-o", options.folder / "picture.exr"};
  words.insert(words.end(), more.begin(), more.end());
  if (!options.device.empty()) words.insert(words.end(), {"--device", options.device});
  return Words(options, words);
}

// Wall time of some runs of a program, after one that fills its caches.
std::vector<ProcessRun> Warm(const AllOptions& options, const std::vector<std::string>& words) {
  RunProcess(words, options.folder);
  std::vector<ProcessRun> runs;
  for (int run = 0; run < options.runs; ++run) runs.push_back(RunProcess(words, options.folder));
  return runs;
}

std::vector<double> Of(const std::vector<ProcessRun>& runs, double ProcessRun::*what) {
  std::vector<double> values;
  for (const ProcessRun& run : runs) values.push_back(run.*what);
  return values;
}

Figures WallFigures(const std::vector<ProcessRun>& runs) {
  Figures figures;
  figures.runs = Of(runs, &ProcessRun::wall_s);
  figures.core_s = core::Median(Of(runs, &ProcessRun::core_s));
  return figures;
}

// A scene of data/scenes whose lamps `./run lamps` has made.
fs::path SceneWithLamp(const AllOptions& options, const std::string& name,
                       const std::string& lamp) {
  const fs::path scene = options.scenes / (name + ".toml");
  const fs::path field = options.scenes / "../../out/lamps" / (lamp + ".lf.exr");
  if (!fs::exists(scene))
    throw InputError(scene.string(), "is not there", "name the folder of the scenes by --scenes");
  if (!fs::exists(field))
    throw InputError(field.lexically_normal().string(), "is not there", "make it by `./run lamps`");
  return scene;
}

std::vector<Figures> MeasureGarage(const AllOptions& options) {
  const fs::path scene = SceneWithLamp(options, "garage", "bike");
  Figures figures = WallFigures(Warm(options, Render(options, scene, {"--error", "3%"})));
  figures.limit = "1024 x 768";
  return {figures};
}

// Each time with caches of its own, which are empty; and once more with the same.
std::vector<Figures> MeasureFirst(const AllOptions& options) {
  const fs::path scene = SceneWithLamp(options, "wall", "car1");
  const auto words = Render(options, scene, {"--error", "3%"});
  const fs::path cache = options.folder / "cache";
  std::vector<ProcessRun> first, warm;
  for (int run = 0; run < options.runs; ++run) {
    fs::remove_all(cache);
    const Variables variables{{"XDG_CACHE_HOME", cache}, {"POCL_CACHE_DIR", cache / "pocl"}};
    fs::create_directories(cache / "pocl");
    first.push_back(RunProcess(words, options.folder, variables));
    warm.push_back(RunProcess(words, options.folder, variables));
  }
  fs::remove_all(cache);
  constexpr double kMore_s = 5;
  Figures figures = WallFigures(first);
  figures.peer = "the same, warm";
  figures.peer_value = core::Median(Of(warm, &ProcessRun::wall_s));
  figures.target = *figures.peer_value + kMore_s;
  figures.limit = "render wall --error 3%, 1024 x 768";
  return {figures};
}

// A mesh of hills under the sky of an afternoon.
fs::path HillsUnderSky(const AllOptions& options, int triangles) {
  const fs::path mesh = options.folder / "hills.ply", sky = options.folder / "sky.hdr",
                 scene = options.folder / "hills.toml";
  WritePly(mesh, HillMesh(triangles));
  RunProcess(Words(options, {"sky", "-o", sky, "--latitude", "48", "--date", "2024-06-21", "--time",
                             "15:00", "--height", "512"}),
             options.folder);
  core::WriteFileAtomically(scene,
                            HillScene("hills.ply") + "\n[environment]\nfile = \"sky.hdr\"\n");
  return scene;
}

std::vector<Figures> MeasureEnvironmentMesh(const AllOptions& options) {
  const fs::path scene = HillsUnderSky(options, kSmallMesh);
  Figures figures = WallFigures(
      Warm(options, Render(options, scene, {"--spp", "4", "--width", "512", "--height", "384"})));
  figures.limit = "375 k triangles, 512 x 384; lighting itself, 0.33 s on two cores";
  return {figures};
}

std::vector<Figures> MeasureLargeMesh(const AllOptions& options) {
  const fs::path scene = HillsUnderSky(options, kLargeMesh);
  const auto runs =
      Warm(options, Render(options, scene, {"--spp", "16", "--width", "512", "--height", "384"}));
  std::vector<Figures> figures{WallFigures(runs), {}};
  for (const ProcessRun& run : runs) figures[1].runs.push_back(run.peak_mib / kMibInGib);
  for (Figures& each : figures) each.limit = "512 x 384; the file, 0.11 GB, and Embree's hierarchy";
  fs::remove(options.folder / "hills.ply");
  return figures;
}

std::vector<Figures> NotHere(const AllOptions&) {
  Figures figures;
  figures.peer = "Cycles, Mitsuba 3";
  figures.limit =
      "not measured by this command: these programs are no part of luxfield, see `luxfield bench "
      "peers`";
  return {figures, figures};
}

std::vector<Figures> MeasureStart(const AllOptions& options) {
  const fs::path field = options.folder / "small.lf.exr";
  lightfield::WriteLightField(field, render::SyntheticCar2({5, 5, 256, 1}));
  std::vector<Figures> figures(2);
  figures[0].runs = Of(Warm(options, {LuxfieldProgram(), "--help"}), &ProcessRun::core_s);
  figures[1].runs = Of(Warm(options, {LuxfieldProgram(), "info", field}), &ProcessRun::core_s);
  figures[0].limit = "starting a process";
  figures[1].limit = "25 images of 256 x 256, all read and checked";
  return figures;
}

std::vector<Figures> MeasureLargeField(const AllOptions& options) {
  const fs::path scene = WriteCarField(options.folder, 20, 16, 1024);  // 1.34 GB
  constexpr double kData_gib = 320.0 * 1024 * 1024 * 4 / (1 << 30), kOver = 1.1;
  std::vector<ProcessRun> runs;
  const auto words =
      Render(options, scene,
             {"--estimator", "volume", "--shadows", "none", "--width", "512", "--height", "384"});
  for (int run = 0; run < options.runs; ++run) runs.push_back(RunProcess(words, options.folder));
  std::vector<Figures> figures{WallFigures(runs), {}};
  for (const ProcessRun& run : runs) figures[1].runs.push_back(run.peak_mib / kMibInGib);
  figures[1].target = kOver * kData_gib;
  for (Figures& each : figures)
    each.limit = fmt::format(
        "512 x 384; reading a file of {:.3g} GB and {:.3g} GiB of data",
        1e-9 * static_cast<double>(fs::file_size(scene.parent_path() / "car.lf.exr")), kData_gib);
  fs::remove(scene.parent_path() / "car.lf.exr");
  return figures;
}

}  // namespace

std::vector<WorkGroup> ProgramWorks() {
  const std::string wall = "s wall";
  return {
      {{{"render garage --error 3%, warm", wall, 12}}, MeasureGarage},
      {{{"first --error of a fresh machine", wall, 16}}, MeasureFirst},
      {{{"environment-lit mesh, 4 samples, warm", wall, 0.8}}, MeasureEnvironmentMesh},
      {{{"environment-lit mesh at equal error, 1024 x 768", "times Cycles", 0.2},
        {"environment-lit mesh at equal error, 512 x 384", "times Cycles", 0.2}},
       NotHere},
      {{{"--help", "core-s", 0.02}, {"info", "core-s", 0.05}}, MeasureStart},
      {{{"1.34 GB light field, volume", wall, 4},
        {"1.34 GB light field, volume, memory", "GiB", 1.375}},
       MeasureLargeField},
      {{{"6 M triangles, 16 samples", wall, 4}, {"6 M triangles, 16 samples, memory", "GiB", 1}},
       MeasureLargeMesh},
  };
}

}  // namespace luxfield::bench
