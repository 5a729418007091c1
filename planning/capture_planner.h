// Which measurement a scene needs: filters, positions and exposures that light its picture within
// an error, in the least time on the rig (`luxfield plan --max-error`).
//
// The error of a plan is the relative RMSE (docs/theory.md 10) of the irradiance, without shadows,
// of the surfaces that the scene's camera sees, lit by the lab's lamp from every place that the
// scene has a luminaire: RMS of E' - E over the mean of E, with
//
//   truncation   what basis, spacing, number of filters, extent and texels of the images lose: the
//                lamp's own irradiance by quadrature against the noise-free reconstruction's
//   noise        photons, read-out, rounding, dark current, averaged darks and PRNU of every frame
//                through merge and Gram solve, by propagation
//
// and hypot of both. What else a bench gets wrong (stage, print, lamp drift, stray light, shutter)
// is not in it: Simulate measures a plan with all the lab's errors on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/planning/relative_error.h"

namespace luxfield::planning {

struct CapturePlannerOptions {
  std::filesystem::path lab, scene;  // a simulated lab; its [filter] is one of many here
  // Name, unit, order, darks, references, warm-up, and of [exposure] all but min_s, max_s,
  // relevant_share and repeats.
  capture::Plan base;
  int texels = 128;       // at most, along the longer side of the images
  int cells = 72;         // of the lamp's light on F, along its longer side
  int receivers = 600;    // places of the picture, per luminaire
  int truth_nodes = 288;  // per axis of F, of the quadrature of the lamp
  std::uint64_t seed = 1;
};

struct PlannedCapture {
  std::string family;  // "bspline2", "quadratic, dual" ...
  capture::Plan plan;
  int frames = 0;
  double capture_s = 0;  // after homing and warm-up (capture/plan/capture_time.h)
  double truncation = 0, truncation_se = 0;  // the standard error of another choice of receivers
  double noise = 0;
  bool confirmed = false;  // by receivers other than those it was chosen by

  double error() const;
  int positions() const { return plan.geometry.grid.count(); }
};

struct SimulatedCapture {
  RelativeError error;  // against the lamp, on receivers that the search did not see
  // On the receivers of the search, so that it is the plan's alone: error and its part that the
  // predicted truncation explains.
  double rig_s = 0;    // on the rig's clock, after homing and warm-up
  double bench_s = 0;  // of this machine
  int flagged = 0, rejected = 0;
};

class CapturePlanner {
 public:
  // Samples the lamp. Throws InputError naming file and field, for labs with three channels, scenes
  // without luminaires and pictures that the lamp does not light.
  explicit CapturePlanner(const CapturePlannerOptions& options);
  ~CapturePlanner();

  // Of every family the plans that are at least a hundredth more accurate than all faster ones of
  // the family, fastest first.
  // Spacings: the lit part of F in 1 to 18 cells along its longer side, with as many filters as
  // cover it and up to n - 1 fewer; every ladder from the longest exposure that saturates nothing
  // (and shorter ones) up to the camera's longest; five depths of brackets; 1 to 16 repeats.
  std::vector<PlannedCapture> Plans() const;

  // The same plan foretold on receivers that the search did not see, those of Simulate: the best of
  // many plans is partly the luckiest.
  PlannedCapture Confirmed(const PlannedCapture& plan) const;

  // Relative RMSE of the truth itself (against a coarser quadrature), and of the lamp's samples:
  // what no plan of this search can be better than or judged below.
  double truth_error() const;
  double samples_error() const;

  // A plan written as plan.toml, and its lab.toml: the lab with the plan's filters in it.
  void WritePlanAndLab(const PlannedCapture& plan, const std::filesystem::path& plan_toml,
                       const std::filesystem::path& lab_toml) const;

  // The plan captured on the simulated lab, merged and reconstructed; files in `folder`, which is
  // made. With `sources` only these error sources of the lab's file, else those it has enabled.
  // `seed` of the lab.
  SimulatedCapture Simulate(const PlannedCapture& plan, const std::filesystem::path& folder,
                            std::uint64_t seed,
                            const std::optional<std::vector<std::string>>& sources = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The fastest of the plans whose error is at most `max_rel_error`; null: none.
const PlannedCapture* Fastest(const std::vector<PlannedCapture>& plans, double max_rel_error);

// The same, confirmed: plans that turn out to miss it are left out. Confirmed figures take the
// place of those in `plans`.
const PlannedCapture* FastestConfirmed(const CapturePlanner& planner, double max_rel_error,
                                       std::vector<PlannedCapture>* plans);

// The plan of least error. `plans` must not be empty.
const PlannedCapture& MostAccurate(const std::vector<PlannedCapture>& plans);

}  // namespace luxfield::planning
