// Veiling glare of a camera from pictures of a light trap on an evenly lit screen (as ISO 9358 has
// it; docs/theory.md, "Veiling glare").
//
// Nothing comes back from the trap, so what its core shows is light that lens and housing scattered
// there from the field around it. With c the core's mean, m the whole picture's and f the field's
// dimmest level (its 5th percentile), signals less darks over vignetting:
//
//   share = c / m    the veil as a share of a picture's mean, were it spread evenly
//   bound = c / f    of a picture E, light from beyond radius_px veils at most bound max(E):
//                    the core sees all of the field beyond radius_px, and some of the nearer
//
// Of a colour mosaic every site (mosaic_sites.h) is a picture: the share is their mean, the bound
// that of the site that is veiled most.
//
// The trap is the largest region of pixels below half the median that does not touch the border;
// its core are the pixels more than 2/3 of the way in from its edge.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

struct GlarePlace {
  double column = 0, row = 0;  // the core's middle
  int pixels = 0;              // of the core
  double radius_px = 0;        // no part of the trap is farther from any pixel of the core
  double share = 0, share_sigma = 0;
  double bound = 0, bound_sigma = 0;
};

// One picture: `merged` over `sensitivity` (one entry: of all pixels). Standard errors are those of
// the pixels' noise, dark frames included. Throws InputError, naming `what`, if there is no trap or
// its core is smaller than 3 x 3 pixels.
GlarePlace MeasureGlare(const MergedFrame& merged, const std::vector<float>& sensitivity,
                        const std::string& what);

// The same of a camera with a colour mosaic (rig/cfa.h); as above where `cfa` is empty.
GlarePlace MeasureGlare(const MergedFrame& merged, const std::vector<float>& sensitivity,
                        const std::string& cfa, const std::string& what);

struct GlareCalibration {
  int width = 0, height = 0;
  double share = 0, share_sigma = 0;  // mean over the places; the larger of noise and their scatter
  double bound = 0;                   // the largest of any place, plus two standard errors
  double radius_px = 0;               // the largest of any place
  std::vector<GlarePlace> places;
  std::map<std::string, std::string> provenance;
};

// From a session of kind "glare"; session.json says what the sensor does. Throws InputError for
// another session.
GlareCalibration CalibrateGlare(const session::SessionReader& session, bool check_hashes = true);

// *.cal.json (docs/formats/calibration.md). Equal calibrations give equal bytes; no clock time.
nlohmann::json ToJson(const GlareCalibration& calibration);
void WriteGlareCalibration(const std::filesystem::path& path, const GlareCalibration& calibration);

// Whether the file's `format` says so. Throws InputError for what is no JSON with a format.
bool IsGlareCalibration(const std::filesystem::path& path);

struct StatedGlare {
  double share = 0, share_sigma = 0, bound = 0, radius_px = 0;
  std::string sha256;  // of the file
};
// Throws InputError naming file and field: another version, or a camera of another size.
StatedGlare ReadGlareCalibration(const std::filesystem::path& path, const rig::SensorModel& sensor);

}  // namespace luxfield::reconstruct
