// Flats of an even source -> relative sensitivity of every pixel: vignetting, and where the flats
// are good enough PRNU too (docs/formats/calibration.md, "Flat field").
//
//   m_k = sum_f (y_kf - dark_k(t_f)) / sum_f mean_f
//   var(m_k) = sum_f var(y_kf - dark) / (sum_f mean_f)^2
//
// over all flats between a tenth and eight tenths of the sensor's range; dividing by the frames'
// sum of means takes exposure and lamp drift out. A polynomial in column and row (total degree 2,
// 4, 6 or 8: the first whose successor lowers chi^2 by less than three times what its terms would
// by chance) is fitted to m; what it leaves beyond noise is the pattern, PRNU.
//
// Of a colour mosaic every site (mosaic_sites.h) has means, middle and polynomial of its own:
// colours differ in level, and lenses shade them differently. A flat counts for a site if no other
// site is above eight tenths.
//
// Which of both is the better estimate is a matter of light: the measured map errs by its noise,
// the polynomial by the pattern it cannot have. The smaller one is taken, and said. A source that
// is not even goes into either in full: it cannot be told from vignetting.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

struct FlatField {
  int width = 0, height = 0;
  // Relative, 1 in the middle of the polynomial (of a mosaic: of the site's own).
  std::vector<float> sensitivity, sigma;
  bool measured = false;  // else the polynomial
  int degree = 0;         // the sites' largest
  double noise = 0;       // rms of the measured map's sigma over the polynomial
  double pattern = 0;     // rms of the pixels over the polynomial, less 1, noise subtracted
  int flats = 0;          // the sites' fewest
  std::map<std::string, std::string> provenance;
};

// From the pairs of a session of kind "sensor" (PairsOfSession). Defects of the sensor take the
// polynomial. Throws InputError without flats in that range, of every site.
FlatField MeasureFlatField(std::span<const CalibrationPair> pairs, const rig::SensorModel& sensor);

// The same for a session, with its provenance. With a sensor's *.cal.json its noise and defects,
// else what the session states.
FlatField MeasureFlatField(const session::SessionReader& session,
                           const std::filesystem::path& sensor_calibration,
                           bool check_hashes = true);

// *.flat.exr: channels Y and sigma, FLOAT; attributes luxfield:*.
void WriteFlatField(const std::filesystem::path& path, const FlatField& field);

// Puts the map in place of the sensor's vignetting, and its rms sigma, which is what pixels still
// differ by, in place of PRNU. Returns the file's SHA-256. Throws InputError for what is no flat
// field, of a sensor of another size, or holds a sensitivity that is not above 0.
std::string ApplyFlatField(const std::filesystem::path& path, rig::SensorModel& sensor);

nlohmann::json ToJson(const FlatField& field);  // its figures, without the maps

}  // namespace luxfield::reconstruct
