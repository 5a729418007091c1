// `luxfield bench merge`: how fast a session is merged, against disk and memory, and what memory it
// takes.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchMergeOptions {
  int grid_width = 11, grid_height = 9;  // filter positions
  int exposures = 8;                     // a bracket's, each 4 times the one before
  int sensor = 2048;                     // square, pixels
  int lattice = 300;                     // square images on I
  bool reflector = false;                // through a homography in place of an aligned sensor
  std::filesystem::path folder;          // scratch: 2 bytes a pixel of every frame
  // Keeps the sessions, and starts with those that an earlier run kept: writing them durably takes
  // longer than merging them.
  bool keep = false;
  std::vector<std::string> cases;  // those whose names start so; empty: all
};

// Makes a session (a scene of 17 stops, dark frames of every exposure time, references) and merges
// it to a .meas.exr. Rows [{"case", "positions", "exposures", "mpix", "gb", "wall_s", "core_s",
// "mpix_per_s", "disk_share", "copy_ratio", "peak_mib"}]:
//
//   cases  `from disk`: the frames dropped from the page cache before; `cached`; `cached, hashes
//          not checked`; `cached, an eighth of the positions`, whose peak_mib tells how memory
//          grows with the session's length
//   mpix, gb      of a frame; of the frames of all positions, darks and references
//   mpix_per_s    pixels of all those frames over wall_s
//   disk_share    time to read the same files from the disk and do nothing, over wall_s: 1 is as
//                 fast as the disk
//   copy_ratio    wall_s over the time in which the same threads copy the same bytes in memory
//   peak_mib      largest resident set of the process while it merges
//
// Least: every frame is read once (gb), the rest is small; hashing costs gb over 1.8 GB/s a core
// with SHA instructions. Throws InputError if an option is below 1 or no case is asked for,
// DeviceError for the disk.
nlohmann::json BenchMerge(const BenchMergeOptions& options);

// Writes such a session into `folder`, which must not be there.
void WriteMergeSession(const BenchMergeOptions& options, const std::filesystem::path& folder);

}  // namespace luxfield::bench
