// `luxfield bench peers`: the same scenes through Blender's Cycles, Mitsuba 3 and pbrt-v4, at equal
// error.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct PeersOptions {
  std::vector<std::string> scenes;  // of those of peer_scenes.h, names; empty: all
  double error = 0.02;              // relative RMSE that costs are stated for
  int width = 512, height = 384;
  int triangles = 375000;          // of the mesh of hills, about
  int runs = 4;                    // of different seeds and the samples of that error; at least 2
  std::uint64_t seed = 1;          // of the first
  std::string python = "python3";  // that finds the modules bpy, mitsuba and numpy
  std::filesystem::path scripts = "bench/peers";                // export.py and render_*.py
  std::filesystem::path distribution = "data/scenes/tube.ies";  // of the photometric lamp
  std::filesystem::path folder;                                 // scratch
  std::string device;                                           // as --device, ours
  int threads = 0;                                              // of all programs, 0: all
};

// Pictures of some samples a pixel.
struct PeerPoint {
  int spp = 0;
  double core_s = 0;    // median of the process and its children
  double rel_rmse = 0;  // of a picture
};

// What runs of a program tell.
struct PeerFigures {
  std::vector<PeerPoint> points;  // of rising spp, two at least
  double mean = 0,
         mean_se = 0;  // of luminance at the last one, and its standard error over seeds
};

// Samples a pixel of a picture of a relative RMSE: log error is taken as linear in log samples between
// points, since a sampler that stratifies N samples over as many lights errs by 1 / N; outside of all
// points squared errors fall with samples. At least 1, and a point without error as it stands.
double SamplesAtError(const std::vector<PeerPoint>& points, double error);

// What such a picture costs:
//
//   sample_core_s  core-seconds of the last point less those of the first, over the difference of
//                  their samples; at least 0
//   fixed_core_s   those of the first point less its samples': the scene's set-up, and what does not
//                  grow with samples
//   light_core_s   sample_core_s SamplesAtError
//   whole_core_s   fixed_core_s + light_core_s
struct PeerCost {
  double samples = 0, sample_core_s = 0, fixed_core_s = 0, light_core_s = 0, whole_core_s = 0;
};
PeerCost CostAtError(const PeerFigures& figures, double error);

// The powers of four, which all samplers stratify, that are measured for an error: 4, 16 and on to the
// first whose error is at most twice as large, or 256. `measure` tells the error of one.
std::vector<PeerPoint> MeasurePoints(double error,
                                     const std::function<PeerPoint(int spp)>& measure);

// Whether two means of independent pictures agree to 0.05 % of `ours` beyond their noise:
//
//   |peer - ours| <= 0.0005 ours + 3 sqrt(se_ours^2 + se_peer^2).
bool MeansAgree(const PeerFigures& ours, const PeerFigures& peer);

// Rows, for each scene those of luxfield, cycles, mitsuba and pbrt:
//   scene, renderer, spp, rel_rmse, mean
//   samples, sample_core_s, fixed_core_s, light_core_s, whole_core_s   as above, at options.error
//   light_ratio, whole_ratio   ours over the peer's, of light_core_s and whole_core_s: below 1 where
//                              ours is cheaper at equal error
//   mean_off, mean_off_se      the peer's mean over ours less 1, and its standard error
//   agrees                     as MeansAgree
//   missing                    instead of all figures: why the peer could not show the scene
// Throws InputError where a scene or a script is not there, DeviceError where a program fails.
nlohmann::json BenchPeers(const PeersOptions& options);

}  // namespace luxfield::bench
