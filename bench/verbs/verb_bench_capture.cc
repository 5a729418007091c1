// luxfield bench capture
#include "luxfield/bench/verbs/verb_bench_capture.h"

#include <fmt/format.h>

#include <memory>
#include <vector>

#include "luxfield/bench/bench_capture.h"

namespace luxfield::bench {
namespace {

core::Json Run(const BenchCaptureOptions& options) {
  const core::Json rows = BenchCapture(options);
  for (const auto& row : rows) {
    if (row["case"] == "watched") {
      fmt::print(
          "watched   {} frames, {:.2f} core-ms each where it is {:.2f} alone, and {:.2f} of the "
          "window; {:.0f} exposures missed ({:.0f}); frames {}\n",
          row.value("frames", 0), row.value("watched_core_ms", 0.0),
          row.value("alone_core_ms", 0.0), row.value("window_core_ms", 0.0),
          row.value("watched_missed", 0.0), row.value("alone_missed", 0.0),
          row.value("same_frames", false) ? "the same" : "DIFFER");
      continue;
    }
    fmt::print("{:<9} {} frames of {:.1f} MB, ", row.value("case", ""), row.value("frames", 0),
               row.value("frame_mb", 0.0));
    if (row["missed"].is_null())
      fmt::print("{:.2f} ms over their exposure, {:.1f} % of {} s", row.value("overhead_ms", 0.0),
                 100 * row.value("overhead_share", 0.0), options.exposure_s);
    else
      fmt::print("{} exposures at {} a second missed", row.value("missed", 0), options.stream_fps);
    fmt::print("; MiB over its tenths: {:.0f}\n",
               fmt::join(row["peaks_mib"].get<std::vector<double>>(), " "));
  }
  return {{"rows", rows}};
}

}  // namespace

void AddBenchCapture(cli::Program& program, CLI::App& benches) {
  auto options = std::make_shared<BenchCaptureOptions>();
  options->folder = "out/capture";
  CLI::App& verb = program.AddVerb(benches, "capture",
                                   "What checks and storage add to the exposures of a fast camera",
                                   [options] { return Run(*options); });
  verb.add_option("--side", options->side, "Pixels of the square sensor")->capture_default_str();
  verb.add_option("--exposures", options->exposures, "Frames of each of two exposure times")
      ->capture_default_str();
  verb.add_option("--exposure", options->exposure_s, "The shorter of them, s")
      ->capture_default_str();
  verb.add_option("--frames", options->stream_frames, "Frames of the camera with a fixed rate")
      ->capture_default_str();
  verb.add_option("--fps", options->stream_fps, "Its rate")->capture_default_str();
  verb.add_option("--stage", options->stage,
                  "A lab.toml whose [stage] is real: it is homed and asked in every capture")
      ->check(CLI::ExistingFile);
  verb.add_flag("--watched", options->watched,
                "Also take the stream with the window of `capture --view` on its session");
  verb.add_option("--folder", options->folder, "Scratch, on the disk to be measured")
      ->capture_default_str();
}

}  // namespace luxfield::bench
