#include "luxfield/bench/thesis_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/bench/bench_solve.h"
#include "luxfield/core/error.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/preprocess/tables.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/renderer.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

json Row(const std::string& what, const std::string& unit, json thesis, json ours,
         const std::string& how) {
  return {{"what", what},
          {"unit", unit},
          {"thesis", std::move(thesis)},
          {"ours", std::move(ours)},
          {"how", how}};
}

bool Has(const std::string& estimator) {
  const auto list = render::EstimatorList();
  return std::any_of(list.begin(), list.end(),
                     [&](const auto& traits) { return traits.name == estimator; });
}

class Table {
 public:
  explicit Table(const ThesisTableOptions& options)
      : options_(options), device_(render::Device::Open(options.device, options.threads)) {}

  json Make() {
    const core::Progress silent("table of the thesis' figures",
                                1);  // pictures print none of their own
    FramesPerSecond();
    Precomputed();
    Inversion();
    BoundOnSamples();
    ShadowMaps();
    CastingShadowMaps();
    Precomputation();
    Memory();
    Reconstruction();
    return std::move(rows_);
  }

 private:
  render::LitScene Scene(const std::string& name) const {
    auto scene = scene::ReadScene(options_.scenes / (name + ".toml"));
    scene::MakeLambertian(scene.geometry);
    for (const auto& luminaire : scene.luminaires)
      if (!std::filesystem::exists(luminaire.light_field))
        throw InputError(scene.file.string(),
                         fmt::format("its lamp {} is not there", luminaire.light_field.string()),
                         "make the lamps first: ./run lamps");
    return {device_, scene};
  }

  render::RenderOptions Picture(const std::string& estimator, int samples, bool small) const {
    render::RenderOptions picture;
    picture.estimator = estimator;
    picture.samples_per_pixel = samples;
    picture.shadows = render::Shadows::kNone;
    picture.width = small ? options_.small_width : options_.width;
    picture.height = small ? options_.small_height : options_.height;
    return picture;
  }

  // After a small picture, which has the kernels compiled.
  static render::Frame Timed(render::LitScene& scene, const render::RenderOptions& picture) {
    auto small = picture;
    small.width = small.height = 32;
    render::Renderer(scene, small).Render();
    return render::Renderer(scene, picture).Render();
  }

  // At the thesis' 200 samples, and of estimators that need none.
  void FramesPerSecond() {
    auto scene = Scene("street");
    for (const auto& traits : render::EstimatorList()) {
      const bool sampled = !traits.noise_free;
      if (sampled && traits.name != "thesis" && traits.name != render::RenderOptions{}.estimator)
        continue;
      auto picture = Picture(traits.name, 200, false);
      if (traits.map_shadows) picture.shadows = render::Shadows::kThesisMaps;
      const auto times = Timed(scene, picture).times;
      const std::string how = fmt::format("street, {}{}, {} x {}, shadows: {}", traits.name,
                                          sampled ? ", 200 samples" : "", options_.width,
                                          options_.height, render::ShadowsName(picture.shadows));
      rows_.push_back(Row("near field, two headlights of 11 x 9 images 256^2", "frames per second",
                          9, 1 / times.lighting_s, how));
      if (traits.name == "thesis") CostSplit(times, how);
    }
  }

  // Both at so many samples that their noise is far below the difference of the visibilities.
  void ShadowMaps() {
    auto scene = Scene("wall");
    for (const auto& traits : render::EstimatorList()) {
      if (!traits.map_shadows || !traits.unbiased_with_shadows) continue;
      auto picture = Picture(traits.name, 8192, true);
      picture.shadows = render::Shadows::kTraced;
      const auto traced = render::Renderer(scene, picture).Render();
      for (const auto maps : {render::Shadows::kThesisMaps, render::Shadows::kMaps}) {
        picture.shadows = maps;
        const auto mapped = render::Renderer(scene, picture).Render();
        rows_.push_back(Row(
            "49 shadow maps 192^2 against ray tracing", "mean Lab", 1.2,
            core::Compare(mapped.radiance, traced.radiance).mean_lab,
            fmt::format("wall, {}, {} samples, {}, {} x {}", traits.name, picture.samples_per_pixel,
                        render::ShadowsName(maps), options_.small_width, options_.small_height)));
      }
      return;
    }
  }

  // Anew, as for every frame of moving lamps; the pictures' times above do not contain it.
  void CastingShadowMaps() {
    constexpr int kSize = 192;
    auto scene = Scene("street");
    scene.Require({.sat = true});
    double best_s = 1e9;
    int maps = 0;
    for (int run = 0; run < 3; ++run) {
      const core::Stopwatch stopwatch;
      maps = 0;
      for (const auto& luminaire : scene.luminaires()) {
        const auto& light_field = *luminaire.light_field;
        const auto cells =
            render::ReferencePositions(light_field.geometry(), light_field.reference);
        const render::ShadowMaps cast(device_, light_field.geometry(), cells,
                                      luminaire.world_from_luminaire, *scene.geometry().rays,
                                      kSize);
        device_.Finish();
        maps += static_cast<int>(
            std::count_if(cells.begin(), cells.end(), [](const auto& cell) { return cell.lit; }));
      }
      best_s = std::min(best_s, stopwatch.WallSeconds());
    }
    rows_.push_back(
        Row("shadow maps of a frame, two headlights of 11 x 9 images", "ms", "9.2 % of 111",
            1e3 * best_s,
            fmt::format("street, {} maps of {}^2 by a ray per texel, best of 3", maps, kSize)));
  }

  void CostSplit(const render::RenderTimes& times, const std::string& how) {
    double total = 0;
    std::string split;
    for (const auto& kernel : times.kernels) total += kernel.device_s;
    for (const auto& kernel : times.kernels)
      split += fmt::format("{}{} {:.1f}", split.empty() ? "" : ", ", kernel.name,
                           100 * kernel.device_s / total);
    rows_.push_back(Row("cost split", "%",
                        "sampling 33.6, shading 31.9, accumulation 16.2, shadow 9.2, step 1 5.3, "
                        "other 3.8",
                        split, how));
  }

  // How many samples and how much time one global table takes to the error of restricted ones; the
  // error of both falls with the square root of the samples.
  void Precomputed() {
    if (!Has("precomputed")) return;
    auto scene = Scene("wall");
    const auto exact = render::Renderer(scene, Picture("exact", 1, true)).Render().radiance;
    const auto ours = Timed(scene, Picture("windowed", 200, true));
    const auto theirs = Timed(scene, Picture("precomputed", 200, true));
    const double ratio = std::pow(core::Compare(theirs.radiance, exact).rel_rmse /
                                      core::Compare(ours.radiance, exact).rel_rmse,
                                  2);
    const std::string how = fmt::format("wall, windowed at 200 samples, {} x {}, no shadows",
                                        options_.small_width, options_.small_height);
    rows_.push_back(Row("samples of precomputed importance sampling for the same error", "times",
                        "above 1000", ratio, how));
    rows_.push_back(Row("its time for the same error", "times", 4821.0 / 62,
                        ratio * theirs.times.lighting_s / ours.times.lighting_s, how));
  }

  // Searches of the distributions cut off after three steps, where the thesis compares the two.
  void Inversion() {
    auto scene = Scene("street");
    const auto exact = render::Renderer(scene, Picture("exact", 1, true)).Render().radiance;
    const auto cut_off = [&](const char* inversion) {
      auto picture = Picture("thesis", 200, true);
      for (const std::string& knob :
           {fmt::format("inversion={}", inversion), std::string("depth=3"),
            std::string("allocation=systematic"), std::string("correlation=decorrelated")})
        picture.knobs.Set(knob);
      return Timed(scene, picture);
    };
    const auto secant = cut_off("secant"), bisection = cut_off("bisection");
    const std::string how =
        fmt::format("street, thesis, 200 samples, systematic and decorrelated, {} x {}, no shadows",
                    options_.small_width, options_.small_height);
    rows_.push_back(Row("secant search of 3 steps: error", "mean Lab", 0.89,
                        core::Compare(secant.radiance, exact).mean_lab, how + ", against exact"));
    rows_.push_back(Row("bisection of 3 steps: error", "mean Lab", 0.93,
                        core::Compare(bisection.radiance, exact).mean_lab,
                        how + ", against exact"));
    rows_.push_back(Row("secant's time over bisection's", "times", 84.0 / 84,
                        secant.times.lighting_core_s / bisection.times.lighting_core_s, how));
  }

  void BoundOnSamples() {
    auto scene = Scene("garage");
    for (const char* estimator : {"thesis", "windowed"}) {
      auto picture = Picture(estimator, 200, true);
      const auto free = Timed(scene, picture);
      picture.max_samples_per_image = 7;
      const auto bounded = Timed(scene, picture);
      const std::string how = fmt::format("garage, {}, 200 samples, {} x {}, no shadows", estimator,
                                          options_.small_width, options_.small_height);
      rows_.push_back(Row("K_max = 7: speed with over without", "times", 13.5 / 11.6,
                          free.times.lighting_s / bounded.times.lighting_s, how));
      rows_.push_back(Row("K_max = 7: difference of the pictures", "mean Lab", 0.63,
                          core::Compare(bounded.radiance, free.radiance).mean_lab, how));
    }
  }

  void Precomputation() {
    constexpr std::array kThesis_ms = {513, 129, 527};
    constexpr std::array kLamps = {"bike", "car1", "car2"};
    for (std::size_t k = 0; k < kLamps.size(); ++k) {
      const auto file = options_.lamps / fmt::format("{}.lf.exr", kLamps[k]);
      const auto field = lightfield::ReadLightField(file);
      double best_s = 1e9;
      for (int run = 0; run < 3; ++run) {
        const core::Stopwatch stopwatch;
        preprocess::BuildTables(field, file.string(), std::string(64, '0'));
        best_s = std::min(best_s, stopwatch.WallSeconds());
      }
      const auto& g = field.geometry;
      rows_.push_back(Row(fmt::format("precomputation {}, {} x {} x {}^2", kLamps[k], g.grid.width,
                                      g.grid.height, g.lattice.width),
                          "ms", kThesis_ms[k], 1e3 * best_s,
                          "summed-area tables and reference positions, best of 3"));
    }
  }

  void Memory() {
    auto geometry = lightfield::ReadLightField(options_.lamps / "car2.lf.exr").geometry;
    geometry.channels = 3;
    const lightfield::LightField coloured(geometry);
    const auto tables = preprocess::BuildTables(coloured, "car2 in colour", std::string(64, '0'));
    const render::LuminaireOnDevice images(device_, coloured),
        all(device_, coloured, {.sat = &tables});
    constexpr double kMegabyte = 1e6;
    const double image_bytes = static_cast<double>(images.images().bytes());
    rows_.push_back(
        Row("memory, car2 with colour", "MB", 123, image_bytes / kMegabyte, "exact: images alone"));
    rows_.push_back(Row("memory, car2 with colour", "MB", 123,
                        (image_bytes + static_cast<double>(all.sat().bytes())) / kMegabyte,
                        "windowed: images and summed-area tables of 64 bits"));
  }

  void Reconstruction() {
    for (const auto& row : BenchSolve({.repeats = 1}))
      if (row.at("case").get<std::string>().ends_with(", float"))
        rows_.push_back(Row("reconstruction, 345 images 256^2, 3 channels", "s", 180,
                            row.at("wall_s"), "bench solve, float"));
  }

  const ThesisTableOptions& options_;
  render::Device device_;
  json rows_ = json::array();
};

}  // namespace

json ThesisTable(const ThesisTableOptions& options) {
  if (std::min({options.width, options.height, options.small_width, options.small_height}) < 1)
    throw InputError("the thesis' table: pictures need at least one pixel");
  return Table(options).Make();
}

}  // namespace luxfield::bench
