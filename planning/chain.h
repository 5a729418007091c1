// Capture -> merge -> reconstruct on a simulated lab, stage by stage through the files the verbs
// use, each judged by the simulated truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/capture/take/capture.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::planning {

struct ChainOptions {
  std::filesystem::path lab, plan;
  std::filesystem::path folder;  // session/, NAME.meas.exr and NAME.signed.lf.exr are written here
  std::string name = "chain";
  std::optional<std::uint64_t> seed;
  std::vector<std::filesystem::path> calibrations;  // as of merge
  bool keep_session = true;  // false: the session folder is deleted after the merge
};

struct ChainResult {
  capture::CaptureSummary capture;
  reconstruct::MergeSessionSummary merge;
  lightfield::Measurements measurements;
  reconstruct::Reconstruction reconstruction;
  double capture_s = 0, merge_s = 0, reconstruct_s = 0;  // wall, file writing included
};

ChainResult RunChain(const ChainOptions& options);

// How far values are from their truth; sums in double.
struct StageError {
  double rel_rmse = 0;  // RMSE / mean of the truth (large where few values hold all the light)
  double rel_l2 = 0;    // RMSE / RMS of the truth
};
StageError CompareWithTruth(std::span<const float> values, std::span<const float> truth);

// The known irradiances against the lab's true ones, [m][...] as
// SimulatedLab::true_irradiance gives them.
StageError IrradianceError(const lightfield::Measurements& measurements,
                           const std::vector<std::vector<float>>& truth);

}  // namespace luxfield::planning
