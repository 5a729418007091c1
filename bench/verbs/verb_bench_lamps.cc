// luxfield bench lamps
#include "luxfield/bench/verbs/verb_bench_lamps.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "luxfield/bench/bench_lamps.h"
#include "luxfield/bench/verbs/bench_rows.h"

namespace luxfield::bench {
namespace {

core::Json Run(BenchLampsOptions how) {
  how.folder =
      std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  const std::vector<LampsFigures> all = BenchLamps(how);
  std::filesystem::remove_all(how.folder);
  core::Json rows = core::Json::array();
  for (const LampsFigures& figures : all)
    rows.push_back({{"lamps", figures.lamps},
                    {"core_s", CostOf(figures)},
                    {"times_first", CostOf(figures) / CostOf(all.front())},
                    {"spp", figures.samples_per_pixel},
                    {"rel_variance", figures.relative_variance},
                    {"times_first_at_equal_error",
                     CostAtEqualError(figures) / CostAtEqualError(all.front())}});
  core::Json result = FinishOnDevice(rows, how);
  if (all.size() < 2) return result;
  result["exponent"] = ExponentOf(all, CostOf);
  result["exponent_at_equal_error"] = ExponentOf(all, CostAtEqualError);
  fmt::print("cost grows as lamps^{:.3f}, at equal error as lamps^{:.3f}\n",
             result["exponent"].get<double>(), result["exponent_at_equal_error"].get<double>());
  return result;
}

}  // namespace

void AddBenchLamps(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchLampsOptions>(
      program, benches, "lamps", "Time and noise of a picture against the number of its lamps",
      [](const auto& o) { return Run(o); });
  app.add_option("--lamps", how.lamps, "Numbers of lamps, that compared with first")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--width", how.width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Picture height, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--spp", how.samples_per_pixel, "Samples per pixel")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--runs", how.runs, "Pictures of each, of different random numbers")
      ->check(CLI::Range(2, 1000));
  app.add_flag_callback(
      "--no-shadows", [&how] { how.shadows = false; }, "Without shadows");
}

}  // namespace luxfield::bench
