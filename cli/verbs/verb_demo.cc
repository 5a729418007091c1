// luxfield demo: the main job on files of ours.
#include <fmt/format.h>

#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/demo_report.h"
#include "luxfield/cli/shared_file.h"
#include "luxfield/core/progress.h"

namespace luxfield::cli {

void AddDemo(Program& program) {
  struct Options {
    std::string lab = SharedFile("data/labs/headlight.toml"),
                plan = SharedFile("data/plans/demo.toml"),
                scene = SharedFile("data/scenes/demo.toml"), output = "out/demo";
    std::string device;
    int spp = 200;
  };
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("demo", [options, &program] {
    planning::DemoOptions how;
    how.lab = options->lab;
    how.plan = options->plan;
    how.scene = options->scene;
    how.folder = options->output;
    how.device = options->device;
    how.samples_per_pixel = options->spp;
    how.seed = program.common().seed;
    how.threads = program.common().threads;
    const auto result = planning::RunDemo(how);
    core::Json summary = WriteDemoReport(options->output, result);
    for (const auto& stage : result.stages)
      fmt::print("  {:<12} {:>12}  RMSE/mean {:>8.3g} %  from the projection {:>8.3g} %   {}\n",
                 stage.name, core::FormatDuration(stage.wall_s), 100 * stage.error.rel_rmse,
                 100 * stage.projection.rel_rmse, stage.of);
    fmt::print(
        "  flux {:+.3f} %; irradiance without shadows {:.3g} % (floor {:.3g} %); picture "
        "{:.3f} mean Lab (floor {:.3f}), with shadows {:.3f}\n",
        100 * (result.flux.measured / result.flux.lamp - 1),
        100 * result.stages.back().error.rel_rmse, 100 * result.floor_irradiance.rel_rmse,
        result.pictures.lamp.mean_lab, result.pictures.floor.mean_lab,
        result.pictures.shadowed.mean_lab);
    fmt::print("{} in all; look at {}/report.html and {}/picture.png\n",
               core::FormatDuration(result.total_wall_s), options->output, options->output);
    return summary;
  });
  verb.add_option("--lab", options->lab, "The simulated lab")
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option("--plan", options->plan, "What to measure")
      ->check(InputFile({core::FileKind::kPlan}));
  verb.add_option("--scene", options->scene, "What to light with it")
      ->check(InputFile({core::FileKind::kScene}));
  verb.add_option("-o,--output", options->output,
                  "Folder for every file of the run; an earlier demo's is replaced");
  verb.add_option("--spp", options->spp, "Light samples per pixel of the picture");
  verb.add_option("--device", options->device, "OpenCL device (default: the first)");
}

}  // namespace luxfield::cli
