// The main job at full size, judged stage by stage: simulated headlight -> session -> light field
// -> tables -> picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/measures.h"
#include "luxfield/planning/chain.h"
#include "luxfield/render/renderer.h"

namespace luxfield::planning {

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
  StageError error;       // against the lamp itself
  StageError projection;  // against what an ideal measurement on the same grid gives
  std::string of;         // what is compared with what
};

// Pictures against each other; without shadows, unless they say so.
struct DemoPictures {
  core::Difference lamp;        // lit by the measurement, against the scene lit by the lamp itself
  core::Difference projection;  // the same against the scene lit by the lamp's projection
  // Lit by the projection or by what an ideal measurement is solved to, whichever is nearer,
  // against the lamp itself.
  core::Difference floor;
  core::Difference shadowed;   // picture.exr, its samples and shadows, against the lamp itself
  core::Difference reference;  // the lamp's picture against itself: standard error
};

struct DemoFlux {
  double lamp = 0, lamp_se = 0;  // through the lattice, with the standard error of its tracing
  double measured = 0, non_negative = 0, projection = 0;
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
  DemoPictures pictures;
  DemoFlux flux;
  render::Frame frame;
  lightfield::LightField coefficients;  // C >= 0, what the picture is lit by
  lightfield::LightField truth;         // the lamp's projection
  // What C >= 0 costs: the non-negative solve after the signed one that the reconstruct stage is
  // judged by.
  double non_negative_s = 0;
  StageError non_negative_error, non_negative_projection;
  StageError floor;             // the projection's coefficients, against the lamp's rays
  StageError floor_irradiance;  // of the scene without shadows, as pictures.floor
  double judging_s = 0;         // wall time of all comparisons
};

// Writes session/, headlight.meas.exr, headlight.signed.lf.exr, headlight.sigma.lf.exr,
// headlight.lf.exr, headlight.tab.exr, truth.lf.exr (the projection), ideal.lf.exr, picture.exr.
DemoResult RunDemo(const DemoOptions& options);

}  // namespace luxfield::planning
