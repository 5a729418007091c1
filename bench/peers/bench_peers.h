// `luxfield bench peers`: the same scenes through Blender's Cycles and Mitsuba 3, at equal error.
#pragma once

#include <cstdint>
#include <filesystem>
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
  std::string python = "python3";  // that finds the modules bpy and mitsuba
  std::filesystem::path scripts = "bench/peers";                // export.py and render_*.py
  std::filesystem::path distribution = "data/scenes/tube.ies";  // of the photometric lamp
  std::filesystem::path folder;                                 // scratch
  std::string device;                                           // as --device, ours
  int threads = 0;                                              // of all programs, 0: all
};

// What runs of a program tell, at few samples a pixel and at more.
struct PeerFigures {
  int few = 0, spp = 0;
  double few_core_s = 0, core_s = 0;  // medians of the process and its children
  double rel_rmse = 0;                // at spp, of a picture
  double mean = 0,
         mean_se = 0;  // of luminance, and its standard error, from the scatter over seeds
};

// What a picture of a relative RMSE costs, from such figures:
//
//   sample_core_s  (core_s - few_core_s) / (spp - few), at least 0
//   fixed_core_s   few_core_s - few sample_core_s: the scene's set-up, and what does not grow with
//                  samples
//   light_core_s   sample_core_s max(1, spp (rel_rmse / error)^2), as squared errors fall with samples
//   whole_core_s   fixed_core_s + light_core_s
struct PeerCost {
  double sample_core_s = 0, fixed_core_s = 0, light_core_s = 0, whole_core_s = 0;
};
PeerCost CostAtError(const PeerFigures& figures, double error);

// The power of four, which all samplers stratify, that should be nearest to the error by its ratio,
// going by the error of few samples; 16 to 256.
int SamplesFor(double error, double few_rel_rmse, int few);

// Whether two means of independent pictures agree to 0.05 % of `ours` beyond their noise:
//
//   |peer - ours| <= 0.0005 ours + 3 sqrt(se_ours^2 + se_peer^2).
bool MeansAgree(const PeerFigures& ours, const PeerFigures& peer);

// Rows, for each scene those of luxfield, cycles and mitsuba:
//   scene, renderer, spp, rel_rmse, mean
//   sample_core_s, fixed_core_s, light_core_s, whole_core_s   as above, at options.error
//   light_ratio, whole_ratio   ours over the peer's, of light_core_s and whole_core_s: below 1 where
//                              ours is cheaper at equal error. light_ratio is that of the products
//                              of core-seconds and squared error.
//   mean_off, mean_off_se      the peer's mean over ours less 1, and its standard error
//   agrees                     as MeansAgree
//   missing                    instead of all figures: why the peer could not show the scene
// Throws InputError where a scene or a script is not there, DeviceError where a program fails.
nlohmann::json BenchPeers(const PeersOptions& options);

}  // namespace luxfield::bench
