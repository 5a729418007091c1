// `luxfield bench environment`: environment maps as light sources, how right, how noisy, how fast.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchEnvironmentOptions {
  std::vector<std::filesystem::path> maps;  // empty: a sun and sky of ours (environment/sun_sky.h)
  std::filesystem::path sequence;           // folder or list of frames; empty: none is timed
  // Of "maps", "balance" (with "thesis"), "speed", "tables"; empty: all of them.
  std::vector<std::string> parts;
  int face_size = 256;                               // texels along a face of the cube maps
  int width = 1024, height = 768;                    // of the pictures that are timed
  std::vector<int> samples_per_pixel{64, 256, 600};  // of them
  int error_width = 192, error_height = 144;         // of the pictures whose errors are compared
  // Independent draws of the irradiance for each orientation; a 16th as many seeds of shared and
  // interleaved sets.
  int copies = 4096;
  int reference_samples = 8192;  // per pixel of both halves of a reference together
  int seeds = 8;                 // pictures that errors are averaged over
  int repeats = 3;               // the least time counts; 0: nothing is timed
  std::string device;            // as --device
  int threads = 0;               // of an OpenCL CPU device, 0: all
};

// An object of rows:
//
// "maps", for each map and strategy: "map", "strategy", "pdf_error", the largest |integral of the
// density over a tile - 1|; of 24 orientations "z_mean_square" and "z_worst", the irradiance's
// errors against lightfield::Irradiance in standard errors, over independent samples (shared sets:
// seeds of each orientation's own); "edge_z_mean_square" and "edge_z_worst", the same where a
// corner of a face lies on the horizon, where a face comes in. The last row pools them: "z_values",
// their "chi_squared", "sigmas", how far that lies above z_values in its own standard deviations,
// and both worst.
//
// "balance", three balls on a floor (bench/ball_scene.h) under each map, without shadows: "map",
// "surface" (lambert, glossy), "balance", "tiles", "sets", "compensation", "spp", "rel_rmse" and
// "mean_lab" of the radiance over the pixels that hit something, "useful", the share of samples
// above the horizon in directions where there is light, "samples", those taken per pixel, and
// "core_s". References are two halves of independent samples; "reference_rel_rmse" is their own
// error.
//
// "thesis", 60 balanced samples against 180 shared out evenly, for each map, surface and kind of
// sets: "error_ratio" of rel_rmse and "lab_ratio" of mean_lab (below 1: the 60 are better),
// "useful_60", "useful_180".
//
// "speed", under the first map: "surface", "shadows", "sets", "spp", "samples_per_s" (wall time),
// "core_ns_per_sample", "fps".
//
// "tables": "face_size", "tiles", "tables_ms" (wall time), "core_ms", both of the tables alone, and
// "upload_ms", of checking and uploading a frame.
//
// "sequence" (bench/bench_environment_sequence.h), if there is one.
//
// Throws InputError, DeviceError.
nlohmann::json BenchEnvironment(const BenchEnvironmentOptions& options = {});

}  // namespace luxfield::bench
