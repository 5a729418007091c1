// luxfield bench pictures
#include "luxfield/bench/verbs/verb_bench_pictures.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/fast_pictures.h"
#include "luxfield/bench/verbs/bench_rows.h"
#include "luxfield/bench/verbs/pictures_report.h"
#include "luxfield/cli/named_files.h"

namespace luxfield::bench {
namespace {

core::Json Run(const FastPicturesOptions& how, const std::filesystem::path& folder) {
  const auto pictures = MakeFastPictures(how);
  core::Json rows = core::Json::array();
  for (const FastPicture& picture : pictures)
    rows.push_back({{"picture", picture.name},
                    {"rel_rmse", picture.difference.rel_rmse},
                    {"noise", picture.noise},
                    {"bias", picture.difference.bias},
                    {"mean_lab", picture.difference.mean_lab},
                    {"core_s", picture.fast.times.lighting_core_s},
                    {"reference_core_s", picture.reference.times.lighting_core_s}});
  core::Json result = FinishOnDevice(rows, how);
  fmt::print("{}\n", WriteFastPictures(pictures, folder).string());
  return result;
}

}  // namespace

void AddBenchPictures(cli::Program& program, CLI::App& benches) {
  auto folder = std::make_shared<std::filesystem::path>("out/pictures");
  const auto [app, how] = AddDeviceBench<FastPicturesOptions>(
      program, benches, "pictures",
      "Fast ways to a picture beside their references: pictures, differences, a page",
      [folder, &program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return Run(o, *folder);
      });
  app.add_option("SCENE", how.scene, "The scene.toml, with a luminaire")
      ->required()
      ->check(cli::InputFile({core::FileKind::kScene}));
  app.add_option("-o,--folder", *folder, "Where pictures go")->capture_default_str();
  app.add_option("--width", how.width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Picture height, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--spp", how.samples_per_pixel, "Samples per pixel of fast ways that sample")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--reference-spp", how.reference_samples,
                 "Samples per pixel of references that sample")
      ->check(CLI::Range(1, 1 << 20));
}

}  // namespace luxfield::bench
