// What `calibrate geometry` shows: a table on the terminal, a page with the residuals' plots.
#pragma once

#include <filesystem>

#include "luxfield/reconstruct/calibrate/geometry/calibrate_geometry.h"

namespace luxfield::cli {

void PrintGeometryCalibration(const reconstruct::GeometryCalibration& calibration);

// Every parameter with its standard uncertainty; residuals of all corners as a cloud, against their
// distance from the picture's middle (distortion left over bends that) and against the place within
// the pixel (a detection with bias waves there), each in standard deviations of the detection.
void WriteGeometryReport(const reconstruct::GeometryCalibration& calibration,
                         const std::filesystem::path& html);

}  // namespace luxfield::cli
