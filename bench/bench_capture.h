// `luxfield bench capture`: what a capture adds to the exposures of a fast camera.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>

namespace luxfield::bench {

struct BenchCaptureOptions {
  int side = 2048;           // pixels, of a square 16-bit sensor
  int exposures = 100;       // of each of two exposure times, for the overhead
  double exposure_s = 0.1;   // the shorter; the other is twice as long
  int stream_frames = 1000;  // of a camera that gives frames at a fixed rate
  double stream_fps = 20;
  // A lab.toml whose [stage], a real one, takes the place of the simulated one: homed, sent to its
  // middle and asked for where it stands, as in every capture.
  std::optional<std::filesystem::path> stage;
  bool watched = false;          // whether the stream is also taken with `view` on its session
  std::filesystem::path folder;  // scratch, on the disk to be measured: 2 bytes a pixel and frame
};

// Captures two sessions, checks and storage and all, from a camera of this process whose frames are
// ready when their exposure ends. Rows [{"case", "frames", "frame_mb", "overhead_ms",
// "overhead_share", "missed", "peaks_mib"}]:
//
//   case `overhead`  a bracket of two exposure times. overhead_ms is what the time from frame to
//                    frame exceeds the exposure by, the mean over the longer one, whose frames are
//                    compared with the shorter as well; overhead_share is that over `exposure_s`,
//                    the shorter one
//   case `stream`    a camera that starts an exposure every 1 / stream_fps s, of four fifths of
//                    that, whether it is asked or not: `missed` starts had to pass unused
//   peaks_mib        largest resident set over each tenth of the frames
//
// With `watched` a row more: the stream three times alone and three times with the window that
// `capture --view` opens on its session, alternating. "case" `watched`, "frames", "frame_mb",
// "alone_core_ms" and "watched_core_ms" of the capturing process for a frame, "window_core_ms" of the
// window likewise, its start included, "alone_missed" and "watched_missed", medians of three; and
// "same_frames": whether all six sessions have the same frames by SHA-256. Needs a display.
//
// Frames are copied once when they are handed over, which is what unpacking 16-bit pixels is. There
// is no monitor: it would be read before and after each exposure, for as long as it takes.
// Least for a frame: read once to judge it, once to hash, once to write. Throws InputError for
// options below 1 and a lab without a real stage, HardwareError of that stage.
nlohmann::json BenchCapture(const BenchCaptureOptions& options);

}  // namespace luxfield::bench
