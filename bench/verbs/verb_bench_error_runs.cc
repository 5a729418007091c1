// luxfield bench error-runs
#include "luxfield/bench/verbs/verb_bench_error_runs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "luxfield/bench/all/bench_error_runs.h"
#include "luxfield/bench/verbs/bench_rows.h"
#include "luxfield/cli/named_files.h"

namespace luxfield::bench {
namespace {

core::Json Run(ErrorRunsOptions how) {
  how.folder =
      std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  const core::Json rows = BenchErrorRuns(how);
  std::filesystem::remove_all(how.folder);
  core::Json result = FinishOnDevice(
      rows, how, {"run", "estimator", "spp", "core_s", "wall_s", "estimated", "reached"});
  result["summary"] = ErrorRunsSummary(rows);
  const core::Json& summary = result["summary"];
  fmt::print(
      "{} asked, {} threads of load: another estimator than most in {} of {} runs, which costs "
      "{:.3g} "
      "times as much; core-seconds {:.3g}, at most {:.3g}; error at most {:.3g} %\n",
      how.error, how.load, summary["flips"].get<int>(), summary["runs"].get<int>(),
      summary["flip_ratio"].get<double>(), summary["core_s"].get<double>(),
      summary["worst_core_s"].get<double>(), 100 * summary["worst_reached"].get<double>());
  return result;
}

}  // namespace

void AddBenchErrorRuns(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<ErrorRunsOptions>(
      program, benches, "error-runs",
      "Choice and cost of `render --error`, again and again on a busy machine",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return Run(o);
      });
  app.add_option("SCENE", how.scene, "The scene.toml")
      ->required()
      ->check(cli::InputFile({core::FileKind::kScene}));
  app.add_option("--error", how.error, "The relative RMSE that is asked for");
  app.add_option("--runs", how.runs, "Of different random numbers")->check(CLI::Range(2, 1000));
  app.add_option("--load", how.load, "Threads that compute something else meanwhile")
      ->check(CLI::Range(0, 1024));
  app.add_option("--width", how.width, "Picture width instead of the scene's, pixels")
      ->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Picture height instead of the scene's, pixels")
      ->check(CLI::Range(1, 16384));
}

}  // namespace luxfield::bench
