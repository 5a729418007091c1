// How a session went, from its journal: what a reader needs to decide whether to trust it.
//
// Times are seconds since the session's first line: within an epoch by the rig's monotonic clock;
// from one epoch to the next by UTC, or none where that goes back (simulated clocks begin anew).
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/capture/plan/session_edges.h"
#include "luxfield/session/session_check.h"

namespace luxfield::capture {

struct TimedValue {
  double t_s = 0, value = 0;
};
using TimeSeries = std::vector<TimedValue>;

// A journal line of a kind that does not come with every frame.
struct SessionEvent {
  double t_s = 0;
  std::string utc, what;
};

// From one start or resumption of the capture to its end.
struct ReviewedEpoch {
  int number = 0;
  double begin_s = 0, end_s = 0;
  std::string utc;                                         // of its begin
  int frames = 0;                                          // committed
  bool paused = false, suspended = false, sealed = false;  // none: cut short, or it goes on
  nlohmann::json devices;                                  // identities by role
  TimeSeries committed;                                    // number of the session's frames so far
};

// Of all brackets (prints and channels) of a filter position; shares of the usable pixels.
struct ReviewedPosition {
  int i = 0, j = 0;
  bool whole = false;  // has a finished bracket; what follows is of its frames
  int frames = 0, rejected = 0, flagged = 0;
  std::optional<double> saturated_share;  // in the shortest exposure: lost; largest of the brackets
  std::optional<double> black_share;      // in the longest exposure: too dark; largest
  std::optional<std::array<double, 2>> residual_m;  // stage: set point less read-back, u and v
};

// Frames of one exposure time, without darks and references.
struct ReviewedExposure {
  double exposure_s = 0;
  int frames = 0, flagged = 0;
  // Level above black over the range from black to saturation, of each frame's brightest pixel:
  // least, median, largest; and of its mean: median. Absent where session.json states no range.
  std::optional<std::array<double, 3>> brightest;
  std::optional<double> mean;
  double saturated_share = 0, black_share = 0;  // means over frames
};

// Of the lamp, as measured last; what the exposures are whole periods of, 0: any.
struct ReviewedPulses {
  double hz = 0, sigma_hz = 0, whole_periods_of_hz = 0;
};

struct RejectedReason {
  std::string reason;  // with # for its numbers
  std::string example;
  int frames = 0;
};

// What was to be done (plan.json).
struct ReviewedPlan {
  std::string name, kind;  // "light-field", "sensor", ...
  std::string id;
  int positions = 0;                // light-field plans
  std::optional<double> spacing_m;  // of the positions
  std::optional<double> max_drift;  // of the references' ratio from 1
};

// Where the session stands.
struct ReviewedState {
  bool sealed = false, torn = false;
  bool in_use = false;  // a process holds the session's lock
};

struct ReviewedCounts {
  int missing = 0;     // positions, or frames of plans of other kinds
  int frames = 0;      // committed
  int superseded = 0;  // of these: taken again in a later epoch, or of unfinished brackets
  int flagged = 0, rejected = 0, probes = 0;
  int rejected_elsewhere = 0;  // in darks, references and frames without a position
  double bytes = 0;            // of committed frames
  int files_missing = 0, files_other_size = 0;
};

// The lamp over time.
struct ReviewedLamp {
  std::map<int, TimeSeries> reference_ratio;  // by channel: rate over the session's first
  TimeSeries suspended_ratio;                 // what it was seen to be while suspended
  TimeSeries meter_ratio;                     // lamp monitor over its first reading, lit frames
  // Reference over meter, at the references: what changed besides the lamp.
  TimeSeries reference_over_meter;
  std::optional<ReviewedPulses> pulses;
  TimeSeries voltage_v, current_a;
};

// The sensor over time.
struct ReviewedSensor {
  TimeSeries temperature_c;
  double dark_exposure_s = 0;  // longest of the darks,
  TimeSeries dark_dn;          // and their mean level above the calibrated black
};

// session.json, as it stands.
struct ReviewedSetup {
  nlohmann::json camera, devices, software;
};

struct SessionReview {
  ReviewedPlan plan;
  ReviewedState state;
  ReviewedCounts counts;
  double duration_s = 0;
  std::vector<ReviewedEpoch> epochs;
  std::vector<SessionEvent> events;
  ReviewedLamp lamp;
  ReviewedSensor sensor;
  std::vector<ReviewedExposure> exposures;  // rising
  std::vector<ReviewedPosition> positions;  // in the plan's order
  std::vector<RejectedReason> reasons;      // most frequent first
  std::optional<SessionEdges> edges;        // light-field plans whose positions all have frames
  ReviewedSetup setup;
  std::optional<session::SessionCheck> check;  // where it was asked for
};

// Reads journal, plan.json and session.json, and of every frame's file the size; no pixels. The
// memory it takes grows by some 2 kB a frame. `verify` also checks every byte (VerifySession).
// Throws InputError for a folder that is no session or whose journal is damaged.
SessionReview ReviewSession(const std::filesystem::path& folder, bool verify = false);

enum class Verdict { kGood, kLook, kBad };
struct Judgement {
  Verdict verdict = Verdict::kGood;
  std::string text;  // one sentence
};
// The worst first, as far as that goes: wholeness, lamp, exposures, re-shoots, stage, temperature,
// files.
std::vector<Judgement> Judge(const SessionReview& review);

// At most `count` spans of equal duration, those without a value left out.
struct Bin {
  double t_s = 0;  // mean
  double mean = 0, min = 0, max = 0;
};
std::vector<Bin> Binned(const TimeSeries& series, int count);

nlohmann::json ToJson(const SessionReview& review);

}  // namespace luxfield::capture
