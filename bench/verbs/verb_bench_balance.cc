// luxfield bench balance
#include "luxfield/bench/verbs/verb_bench_balance.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/bench_balance.h"
#include "luxfield/bench/feedback_pictures.h"
#include "luxfield/bench/verbs/balance_report.h"
#include "luxfield/render/device/device.h"

namespace luxfield::bench {
namespace {

struct Options {
  BenchBalanceOptions bench;
  std::filesystem::path folder = "out/balance";
  bool no_shadows = false, no_search = false, pictures = false;
  int picture_width = 256, picture_height = 192;
};

void Print(const core::Json& result) {
  fmt::print("{:<20} {:<19} {:>12} {:>8} {:>8} {:>9} {:>9}\n", "scene", "strategy", "rel_variance",
             "lab", "core_s", "rel_eff.", "lab, time");
  for (const auto& row : result["rows"])
    fmt::print("{:<20} {:<19} {:>12.4g} {:>8.3f} {:>8.3f} {:>9.3f} {:>9.3f}\n",
               row.value("scene", ""), row.value("strategy", ""), row.value("rel_variance", 0.0),
               row.value("mean_lab", 0.0), row.value("core_s", 0.0),
               row.value("rel_efficiency", 0.0), row.value("equal_time_lab", 0.0));
  if (!result["search"].empty())
    fmt::print(
        "\nRelative variance by search\n{:<20} {:>6} {:>10} {:>10} {:>10} {:>10} {:>10} "
        "{:>10} {:>10}\n",
        "scene", "share", "of all", "each pixel", "known", "known,rest", "2nd order", "Newton",
        "lobe");
  for (const auto& row : result["search"]) {
    fmt::print("{:<20} {:>6.3f}", row.value("scene", ""), row.value("best_share", 0.0));
    for (const char* key :
         {"rel_variance", "of_each_pixel", "known", "known_rest", "second_order", "newton", "lobe"})
      fmt::print(" {:>10.4g}", row.value(key, 0.0));
    fmt::print("\n");
  }
  fmt::print("\nRelative variance of Newton steps over the second-order formula's, less 1\n");
  for (const auto& row : result["steps"])
    fmt::print("{:<20} {:+.3f} +- {:.3f}, z {:+.1f}: {}\n", row.value("scene", ""),
               row.value("newton_over_second_order", 0.0), row.value("se", 0.0),
               row.value("z", 0.0), row.value("holds", false) ? "no worse than by noise" : "WORSE");
  fmt::print("\nEfficiency over that of ...; the thesis claims more than 1\n");
  for (const auto& row : result["claims"])
    fmt::print(
        "{:<20} {:<12} balance {:.3f} +- {:.3f}, power {:.3f} +- {:.3f}, maximum {:.3f} +- "
        "{:.3f}: {}\n",
        row.value("scene", ""), row.value("strategy", ""), row.value("over_balance", 0.0),
        row.value("over_balance_se", 0.0), row.value("over_power", 0.0),
        row.value("over_power_se", 0.0), row.value("over_maximum", 0.0),
        row.value("over_maximum_se", 0.0), row.value("holds", false) ? "holds" : "FAILS");
}

core::Json Run(Options options) {
  options.bench.shadows = !options.no_shadows;
  options.bench.search = !options.no_search;
  core::Json result = BenchBalance(options.bench);
  Print(result);
  for (const auto& file : WriteBalance(result, options.folder)) fmt::print("{}\n", file.string());
  const auto device = render::Device::Open(options.bench.device, options.bench.threads);
  if (options.pictures)
    for (const auto& path : options.bench.scenes) {
      const scene::Scene scene = scene::ReadScene(path, {.light_fields = {},
                                                         .tables = {},
                                                         .width = options.picture_width,
                                                         .height = options.picture_height});
      const auto feedback = MakeFeedback(device, scene,
                                         {.samples_per_light = options.bench.samples_per_light,
                                          .pilot = options.bench.pilot,
                                          .shadows = options.bench.shadows});
      for (const auto& file : WriteFeedback(feedback, options.folder / path.stem()))
        fmt::print("{}\n", file.string());
    }
  result["device"] = device.info().name;
  return result;
}

}  // namespace

void AddBenchBalance(cli::Program& program, CLI::App& benches) {
  auto options = std::make_shared<Options>();
  CLI::App& app = program.AddVerb(
      benches, "balance",
      "Shares of samples that follow light and BRDF: variance, time and efficiency of strategies",
      [options, &program] {
        options->bench.threads = program.common().threads;
        return Run(*options);
      });
  BenchBalanceOptions& how = options->bench;
  app.add_option("--scene", how.scenes, "Scenes (default: ours)")->default_str("");
  app.add_option("--width", how.width, "Pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Pixels")->check(CLI::Range(1, 16384));
  app.add_option("--spp", how.samples_per_light, "Samples per pixel and light");
  app.add_option("--pilot", how.pilot, "Samples of them that choose a share")
      ->check(CLI::Range(2, 64));
  app.add_option("--seeds", how.seeds, "Pictures that a variance is taken over")
      ->check(CLI::Range(4, 1000));
  app.add_option("--reference-spp", how.reference_samples,
                 "Samples per pixel and light of the reference");
  app.add_flag("--no-shadows", options->no_shadows, "Everything is visible");
  app.add_flag("--no-search", options->no_search, "Leave the search for the best shares out");
  app.add_flag("--pictures", options->pictures,
               "Also feedback pictures: shares, variance and Lab differences, samples by face");
  app.add_option("--picture-width", options->picture_width, "Of feedback pictures, pixels");
  app.add_option("--picture-height", options->picture_height, "Of feedback pictures, pixels");
  app.add_option("--folder", options->folder, "Where CSV, plot and pictures go");
  app.add_option("--device", how.device,
                 "OpenCL device: a number or a part of its name (default: the first)");
}

}  // namespace luxfield::bench
