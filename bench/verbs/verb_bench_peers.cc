// luxfield bench peers
#include "luxfield/bench/verbs/verb_bench_peers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "luxfield/bench/peers/bench_peers.h"
#include "luxfield/bench/peers/peer_scenes.h"
#include "luxfield/bench/verbs/bench_rows.h"

namespace luxfield::bench {
namespace {

core::Json Run(PeersOptions how) {
  const bool temporary = how.folder.empty();
  if (temporary)
    how.folder =
        std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  how.folder = std::filesystem::absolute(how.folder);
  const core::Json rows = BenchPeers(how);
  if (temporary) std::filesystem::remove_all(how.folder);
  core::Json result =
      FinishOnDevice(rows, how,
                     {"scene", "renderer", "spp", "rel_rmse", "samples", "sample_core_s",
                      "fixed_core_s", "light_core_s", "whole_core_s", "light_ratio", "whole_ratio",
                      "mean_off", "mean_off_se", "agrees"});
  for (const core::Json& row : rows)
    if (row.contains("missing"))
      fmt::print("missing: {} of {}: {}\n", row["renderer"].get<std::string>(),
                 row["scene"].get<std::string>(), row["missing"].get<std::string>());
  return result;
}

}  // namespace

void AddBenchPeers(cli::Program& program, CLI::App& benches) {
  const auto [app, how] = AddDeviceBench<PeersOptions>(
      program, benches, "peers",
      "Scenes of ours through Cycles, Mitsuba 3 and pbrt-v4, at equal error", [&program](auto& o) {
        o.seed = program.common().seed.value_or(1);
        return Run(o);
      });
  app.add_option("--scene", how.scenes, "Which of the scenes (default: all)")
      ->default_str("")
      ->check(CLI::IsMember(PeerSceneNames()));
  app.add_option("--error", how.error, "Relative RMSE that costs are stated for")
      ->check(CLI::Range(1e-4, 1.0));
  app.add_option("--width", how.width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", how.height, "Picture height, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--triangles", how.triangles, "Of the mesh of hills, about")
      ->check(CLI::Range(2, 100000000));
  app.add_option("--runs", how.runs, "Of different random numbers")->check(CLI::Range(2, 1000));
  app.add_option(
      "--python", how.python,
      "Python with the modules bpy and mitsuba, as `./run foreign` installs it; pbrt is found "
      "in PATH");
  app.add_option("--scripts", how.scripts, "Folder of export.py and the peers' scripts");
  app.add_option("--distribution", how.distribution, "LM-63 file of the photometric lamp");
  app.add_option("--folder", how.folder, "Scratch folder (default: a temporary one)");
}

}  // namespace luxfield::bench
