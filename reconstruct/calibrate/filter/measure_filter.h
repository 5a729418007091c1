// Photographs of a printed filter without the luminaire -> its transmittance about its axis
// (docs/theory.md 3, "Measured filters"; docs/formats/filter.md).
//
//   T = (photograph with the filter / photograph of the light alone)
//       / (the same ratio in the holder's holes)
//
// pixel by pixel, so that vignetting, PRNU and the light's unevenness cancel, and what the light
// changed between the photographs too. The holes of the holder, whose places about the axis are
// known, give the homography from the camera to the filter plane: centroids of their light, exact
// under perspective, least squares with scaled coordinates (Hartley and Zisserman, Multiple View
// Geometry, 4.4). Lens distortion is not modelled: the residual of the holes tells, and is refused
// above kLargestResidual. T is then resampled to texels by exact areas (register_images.h).
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/filter_sheet.h"
#include "luxfield/rig/homography.h"

namespace luxfield::reconstruct {

struct WedgeReading {
  double code = 0;
  double density = 0, sigma = 0;  // of the mean transmittance over the inner half of the step
};

// Per print.
struct PrintReading {
  // Where the print's registration marks put it about the axis.
  lightfield::Vec2 shift_m;
  double rotation_rad = 0;
  double shift_sigma_m = 0, rotation_sigma_rad = 0;
  double mark_residual_m = 0;  // rms of the marks after shift and rotation
  double light_ratio = 0;      // of the photographs, in the holder's holes
  double light_ratio_sigma = 0;
  std::vector<WedgeReading> wedge;
};

struct FilterReadings {
  rig::Homography holder_from_sensor;  // metres
  double pixel_m = 0;                  // mean side of a pixel on the filter
  double holder_residual_m = 0;        // rms of the holes
  double axis_sigma_m = 0;             // of where they put the axis, either coordinate
  double stretch_sigma = 0;            // of an entry of the linear map about it
  std::vector<PrintReading> prints;

  // The printer's tone table from the first print's wedge: steps whose density is above the last
  // one's by 3 of its errors at least. Throws InputError if fewer than two are.
  rig::ToneTable Tone() const;
};
nlohmann::json ToJson(const FilterReadings& readings);

constexpr double kLargestResidual = 0.005;  // of a hole, in spacings

// `light` and `prints` are photographs of one camera in one place: electrons per second, or any
// linear unit. The camera is upright within some 10 degrees. Texels are at most 64 a spacing and
// not smaller than a pixel. Throws InputError naming what is missing: a hole of the holder, a mark
// of the print (a sheet upside down or mirrored lacks one), unknown pixels on the filter, parts of
// a pair in the wrong order.
lightfield::MeasuredFilter MeasureFilter(const rig::FilterSheet& sheet, const MergedFrame& light,
                                         std::span<const MergedFrame> prints,
                                         FilterReadings* readings = nullptr);

}  // namespace luxfield::reconstruct
