// luxfield bench ray-files
#include "luxfield/bench/verbs/verb_bench_ray_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/all/bench_ray_files.h"
#include "luxfield/bench/verbs/bench_rows.h"
#include "luxfield/cli/named_files.h"

namespace luxfield::bench {
namespace {

core::Json Run(BenchRayFilesOptions how) {
  const bool temporary = how.folder.empty();
  if (temporary)
    how.folder =
        std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  const core::Json rows = BenchRayFiles(how);
  if (temporary) std::filesystem::remove_all(how.folder);
  return Finish(
      rows, CpuName(),
      {"work", "format", "mib", "wall_s", "core_s", "rays_per_core_s", "mib_per_s", "peak_mib"});
}

}  // namespace

void AddBenchRayFiles(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchRayFilesOptions>();
  CLI::App& app =
      program.AddVerb(benches, "ray-files", "Ray files written, read and imported, beside the disk",
                      [how] { return Run(*how); });
  app.add_option("LIGHT-FIELD", how->light_field, "The .lf.exr whose rays are drawn")
      ->required()
      ->check(cli::InputFile({core::FileKind::kLightField}));
  app.add_option("--rays", how->rays, "Rays of each file")->check(CLI::Range(1000, 1000000000));
  app.add_option("--formats", how->formats, "Endings of the files")
      ->check(CLI::IsMember({"tm25ray", "dat", "sdf", "ltrf", "speos.ray"}));
  app.add_option("--runs", how->runs, "Of each work")->check(CLI::Range(1, 100));
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
}

}  // namespace luxfield::bench
