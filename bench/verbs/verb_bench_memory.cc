// luxfield bench memory
#include "luxfield/bench/verbs/verb_bench_memory.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/all/bench_memory.h"
#include "luxfield/bench/verbs/bench_rows.h"

namespace luxfield::bench {
namespace {

core::Json Run(BenchMemoryOptions how) {
  const bool temporary = how.folder.empty();
  if (temporary)
    how.folder =
        std::filesystem::temp_directory_path() / fmt::format("luxfield-bench-{}", ::getpid());
  const core::Json rows = BenchMemory(how);
  if (temporary) std::filesystem::remove_all(how.folder);
  return Finish(rows, CpuName(),
                {"work", "positions", "mpix", "read_mib", "written_mib", "wall_s", "core_s",
                 "peak_mib", "disk_s"});
}

}  // namespace

void AddBenchMemory(cli::Program& program, CLI::App& benches) {
  auto how = std::make_shared<BenchMemoryOptions>();
  CLI::App& app = program.AddVerb(
      benches, "memory", "What memory verbs take that work within a limit, beside the disk",
      [how] { return Run(*how); });
  app.add_option(
      "--works", how->works,
      "Those whose names start so: merge, reconstruct, preprocess, render (default: all)");
  app.add_option("--grids", how->grids, "Filters along u and v, one after the other")
      ->check(CLI::Range(2, 64));
  app.add_option("--texels", how->texels, "Along a side of an image")->check(CLI::Range(8, 16384));
  app.add_option("--memory", how->memory, "As of the verbs");
  app.add_option("--filled", how->filled,
                 "Share of an image's rows that hold light; the others are 0, and files are packed")
      ->check(CLI::Range(1e-3, 1.0));
  app.add_option("--runs", how->runs, "Of each work")->check(CLI::Range(1, 100));
  app.add_option("--folder", how->folder, "Scratch folder (default: a temporary one)");
}

}  // namespace luxfield::bench
