// luxfield bench volume
#include "cli/verb_bench_errors.h"

#include "cli/bench_rows.h"
#include "study/bench_volume.h"

namespace luxfield::cli {
namespace {

void AddVolume(Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<study::BenchVolumeOptions>(
      program, benches, "volume", "Do light-vector volumes keep the error they state",
      [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return FinishOnDevice(study::BenchVolume(o), o,
                              {"basis", "grid", "lamp", "nodes", "stated", "receivers", "rel_rmse",
                               "table", "cuts", "cut", "between", "worst", "off", "lost"});
      });
  app.add_option("--receivers", how.receivers, "Receivers of each of four kinds")
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--approximation-error", how.max_rel_error, "Relative error asked of volumes")
      ->check(CLI::Range(1e-5, 1.0));
}

}  // namespace

void AddBenchStatedErrors(Program& program, CLI::App& benches) {
  AddVolume(program, benches);
}

}  // namespace luxfield::cli
