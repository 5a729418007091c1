// luxfield bench volume, bench noise
#include "luxfield/bench/verbs/verb_bench_errors.h"

#include "luxfield/bench/bench_noise.h"
#include "luxfield/bench/bench_volume.h"
#include "luxfield/bench/verbs/bench_rows.h"

namespace luxfield::bench {
namespace {

void AddVolume(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchVolumeOptions>(
      program, benches, "volume", "Do light-vector volumes keep the error they state",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return FinishOnDevice(BenchVolume(o), o,
                              {"basis", "grid", "lamp", "nodes", "stated", "receivers", "rel_rmse",
                               "table", "cuts", "cut", "between", "worst", "off", "lost"});
      });
  app.add_option("--receivers", how.receivers, "Receivers of each of four kinds")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--approximation-error", how.max_rel_error, "Relative error asked of volumes")
      ->check(CLI::Range(1e-5, 1.0));
}

void AddNoise(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<BenchNoiseOptions>(
      program, benches, "noise", "Is the noise that pictures state their scatter over seeds",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return FinishOnDevice(BenchNoise(o), o,
                              {"case", "spp", "noise", "estimate", "ratio", "ratio_se",
                               "as_independent", "four_passes", "scatter", "sigma"});
      });
  app.add_option("--seeds", how.seeds, "Pictures of each case")->check(CLI::Range(2, 100000));
  app.add_option("--width", how.width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Picture height, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--spp", how.samples_per_pixel, "Samples per pixel and light")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--case", how.cases, "Cases whose names start so (default: all)")->default_str("");
}

}  // namespace

void AddBenchStatedErrors(cli::Program& program, CLI::App& benches) {
  AddVolume(program, benches);
  AddNoise(program, benches);
}

}  // namespace luxfield::bench
