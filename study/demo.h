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
  std::string estimator = "cells";
  int samples_per_pixel = 200;
  std::string device;
  int threads = 0;
};

struct DemoStage {
  std::string name;  // capture, merge, reconstruct, preprocess, render
  double wall_s = 0;
  StageError error;  // against the truth of that stage
  std::string of;    // what is compared with what
};

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
  render::Frame frame;
  lightfield::LightField coefficients;  // C >= 0, what the picture is lit by
  lightfield::LightField truth;
  // What C >= 0 costs: the non-negative solve after the signed one that the reconstruct stage is
  // judged by.
  double non_negative_s = 0;
  StageError non_negative_error;
};

// Writes session/, headlight.meas.exr, headlight.signed.lf.exr, headlight.sigma.lf.exr,
// headlight.lf.exr, headlight.tab.exr, truth.lf.exr, picture.exr.
DemoResult RunDemo(const DemoOptions& options);

}  // namespace luxfield::study
