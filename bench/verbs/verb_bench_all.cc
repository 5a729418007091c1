// luxfield bench all
#include "luxfield/bench/verbs/verb_bench_all.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "luxfield/bench/all/bench_all.h"
#include "luxfield/bench/verbs/bench_rows.h"

namespace luxfield::bench {
namespace {

constexpr int kQuickRuns = 3;

// Goes away with what is in it, however the bench ends.
struct TemporaryFolder {
  TemporaryFolder()
      : path(std::filesystem::temp_directory_path() /
             fmt::format("luxfield-bench-{}", ::getpid())) {}
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path path;
};

core::Json Run(AllOptions options, bool quick) {
  if (quick) options.runs = kQuickRuns;
  std::optional<TemporaryFolder> temporary;
  if (options.folder.empty()) options.folder = temporary.emplace().path;
  options.folder = std::filesystem::absolute(options.folder);
  std::filesystem::create_directories(options.folder);
  const core::Json result = BenchAll(options);
  PrintRows(result["rows"],
            {"work", "value", "unit", "target", "ratio_to_target", "peer", "peer_value", "limit"});
  return result;
}

}  // namespace

void AddBenchAll(cli::Program& program, CLI::App& benches) {
  auto options = std::make_shared<AllOptions>();
  auto quick = std::make_shared<bool>(false);
  CLI::App& verb = program.AddVerb(benches, "all",
                                   "Every figure that has a target, beside it and what bounds it",
                                   [options, quick, &program] {
                                     options->threads = program.common().threads;
                                     return Run(*options, *quick);
                                   });
  verb.add_flag("--quick", *quick,
                fmt::format("Medians of {} runs, some ten minutes on two cores", kQuickRuns));
  verb.add_option("--runs", options->runs, "Of each work; the median counts")
      ->check(CLI::Range(1, 100))
      ->excludes("--quick");
  verb.add_option("--work", options->works, "Works whose names contain this (default: all)")
      ->default_str("");
  verb.add_option("--scenes", options->scenes,
                  "Scenes garage and wall; their lamps (`./run lamps`) lie in ../../out/lamps from "
                  "there");
  verb.add_option("--folder", options->folder,
                  "Scratch of 2 GB (default: a temporary one, which goes away)");
  verb.add_option("--device", options->device, "OpenCL device (default: the first)");
}

}  // namespace luxfield::bench
