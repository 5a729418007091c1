// What a regulation asks of a headlamp, as data: files of data/regulations/ and others of the same
// form (docs/formats/regulation.md).
//
// Places are (H, V) in degrees on a sphere with a vertical polar axis about the lamp, H to the right
// of the driver and V upwards, as UN R149 Annex 4 has them:
//
//   direction = cos V (cos H forward + sin H right) + sin V up
//
// Values are luminous intensities as a receiver sees them: illuminance at a distance r times r^2.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/config.h"

namespace luxfield::photometry {

struct Place {
  double h_deg = 0, v_deg = 0;
};

// A bound of a value: cd (lm of a flux), or a share of what another requirement measures.
struct Limit {
  std::optional<double> value;
  double share = 0;
  std::string of;  // the other's name; where `value` is absent
};

struct Requirement {
  enum class Kind {
    kPoint,  // at places[0]
    kLine,   // anywhere from places[0] to places[1]
    kZone,   // anywhere in the polygon of places
    kSum,    // the sum over places
    kPeak,   // the largest value anywhere
    kFlux,   // lm through the rectangle between places[0] and places[1]
  };
  std::string name;
  Kind kind = Kind::kPoint;
  std::vector<Place> places;
  std::optional<Limit> least, most;
  std::string unless;  // what makes it not count, a clause; empty: it always counts
};

// A scan over the cut-off with a small receiver. The gradient at a place x, degrees along the scan
// in the direction that gets darker, is
//
//   G = log10 E(x) - log10 E(x + 0.1)
//
// and the cut-off lies where G is largest, in the middle of the two (UN R149 Annex 6, 2.2.2).
struct CutOffScan {
  Place from, to;  // along one axis, from bright to dark
};

// How the lamp is aimed before it is measured.
struct Aiming {
  enum class Kind {
    kNone,    // as it is
    kPeak,    // the largest value on H = V = 0
    kCutOff,  // by its cut-off
  };
  Kind kind = Kind::kNone;
  // The cut-off on the first scan is brought to this V.
  CutOffScan level;
  double level_v_deg = 0;
  // Sideways: the straight line through the cut-off on these vertical scans meets V = level_v_deg at
  // this H; of one horizontal scan, its cut-off lies there. None: not sideways.
  std::vector<CutOffScan> sideways;
  double sideways_h_deg = 0;
  double sideways_gradient = 0;  // the least on each of these scans
  // How far a lamp may be aimed anew from there, to either side.
  double tolerance_h_deg = 0, tolerance_v_deg = 0;
};

// What is asked of the cut-off itself, in the aimed beam.
struct CutOffLimits {
  double receiver_side_m = 0;
  std::optional<double> least_gradient, most_gradient;  // on the first scan of the aiming
  std::vector<double> straight_h_deg;                   // where its V is compared
  double straight_within_deg = 0;
};

struct Regulation {
  std::string name, source;
  double distance_m = 0;       // of the receiver
  double receiver_side_m = 0;  // of a square
  Aiming aiming;
  std::optional<CutOffLimits> cut_off;
  std::vector<Requirement> requirements;
  // Of a flat screen on which lamps are aimed; absent: none.
  std::optional<double> screen_m;
};

// Throws InputError naming file and field.
Regulation ReadRegulation(const std::filesystem::path& path);

// For traffic on the other side of the road: right and left exchanged, in names too where they end in
// R or L.
Regulation Mirrored(const Regulation& regulation);

}  // namespace luxfield::photometry
