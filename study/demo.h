// The main job at full size, judged stage by stage: simulated headlight -> session -> light field
// -> tables -> picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/measures.h"
#include "render/renderer.h"
#include "study/chain.h"

namespace luxfield::study {

struct DemoOptions {
  std::filesystem::path lab, plan, scene;
  std::filesystem::path folder;  // every file of the run; must be new, empty, or an earlier demo's
  std::optional<std::uint64_t> seed;
  std::string estimator = "windowed";
  int samples_per_pixel = 200;
  std::string device;
  int threads = 0;
};

struct DemoStage {
  std::string name;  // capture, merge, reconstruct, preprocess, render
  double wall_s = 0;
  double rel_rmse = 0;  // against the truth of that stage: RMSE / mean of the truth
  std::string of;       // what rel_rmse compares with what
};

// How much each error source alone moves the picture's end: from the demo's own budget runs.
struct DemoResult {
  std::vector<DemoStage> stages;
  double total_wall_s = 0;
  capture::CaptureSummary capture;
  reconstruct::MergeSessionSummary merge;
  reconstruct::ReconstructionReport reconstruction;
  std::string estimator, device;
  std::vector<double> ladder_s;               // the exposure ladder
  std::vector<double> shortest_s, longest_s;  // bracket of every position, in order of capture
  core::Difference
      picture;  // the rendered picture against the same scene lit by the truth, `exact`
  core::Difference irradiance;
  render::Frame frame;
  lightfield::LightField coefficients, truth;
};

// Writes session/, headlight.meas.exr, headlight.lf.exr, headlight.sigma.lf.exr, headlight.tab.exr,
// truth.lf.exr, picture.exr.
DemoResult RunDemo(const DemoOptions& options);

}  // namespace luxfield::study
