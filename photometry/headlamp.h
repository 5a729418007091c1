// A headlamp against a regulation: aimed as it says, every point, line, zone, sum and flux that it
// asks for, with what probability each is met and all are (docs/photometry.md, "Headlamps").
//
// To first order in the noise: places where a line or a zone has its smallest or largest value do not
// move, and the aim moves with the noise of the cut-off that it follows.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/photometry/asked.h"
#include "luxfield/photometry/cut_off.h"
#include "luxfield/photometry/regulation.h"

namespace luxfield::photometry {

enum class Verdict {
  kPass,
  kFail,
  // Some of the light of these directions left the measured part of I: values are not above what was
  // measured, which meets a least value or exceeds a largest one, but says no more.
  kNotMeasured,
};

// One limit of a requirement.
struct Finding {
  std::string name;
  Requirement::Kind kind = Requirement::Kind::kPoint;
  bool is_least = false;   // the limit is a smallest value, else a largest one
  double limit = 0;        // cd; lm of a flux
  std::string limit_text;  // "0.8 x 50R" of a share; empty: the number says it
  Estimate value;
  Place place;      // where the smallest or largest value is; of a sum its first place
  Estimate margin;  // not below 0: met; its u has that of the limit in it
  Verdict verdict = Verdict::kPass;
  std::optional<double> pass_probability;  // absent without noise
  std::string unless;                      // what makes it not count; then it does not
};

struct CutOffFindings {
  Place place;                    // on the first scan of the aiming, in the aimed beam
  bool has_gradient_peak = true;  // cut_off.h
  Estimate gradient;
  // The largest difference of V among the places asked for, degrees; absent where one has no cut-off.
  std::optional<double> spread_deg;
  bool gradient_met = false, straight = false;
  std::optional<double> gradient_probability;
  std::vector<CutOff> along;        // from left to right, every degree where there is one
  std::optional<CutOff> at_screen;  // on the first scan, seen at the distance of the aiming screen
};

// The smallest relative margin over all findings that count, for lamps that are aimed anew.
struct AimSweep {
  std::vector<double> h_deg, v_deg;  // from the aim
  std::vector<double> margin;        // [v][h]: (value - limit) / limit, or its negative
  std::vector<int> failed;           // [v][h]: how many fail
};

// The road as the driver sees it who looks straight ahead along it. A place of the view is a line of
// sight, by tangents to the right and below the horizon.
struct RoadView {
  lightfield::Vec3 eye_m;      // in the luminaire's frame
  BeamFrame frame;             // of the aimed lamp
  double eye_height_m = 0;     // above the road
  double left = 0, right = 0;  // tangents
  double nearest = 0,
         farthest = 0;  // tangents below the horizon, of the lowest row and the highest
  int columns = 0, rows = 0;

  // What a row shows of the road, a line across it; row 0 at the top.
  PlaneAsked LineOf(int row) const;
};
// Illuminance on the road where lines of sight meet it, [row][column].
std::vector<double> IlluminanceIn(const Lamp& lamp, const RoadView& view);

struct Headlamp {
  HeadlampAsked asked;
  Place aimed;  // where H = V = 0 of the aimed lamp lies before aiming
  std::optional<std::array<double, 2>> aimed_u_deg;  // of both angles
  std::vector<Finding> findings;
  std::optional<CutOffFindings> cut_off;
  Verdict verdict = Verdict::kPass;        // of all that counts
  std::optional<double> pass_probability;  // that all of it is met
  std::optional<AimSweep> sweep;           // where the regulation lets a lamp be aimed anew
  PlaneAsked screen, road;                 // of illuminance: before the lamp, and on the ground
  std::optional<PlaneAsked> aiming_screen;
  RoadView view;
  std::vector<std::string> remarks;
};

Headlamp HeadlampOf(const Lamp& lamp, const HeadlampAsked& asked);

}  // namespace luxfield::photometry
