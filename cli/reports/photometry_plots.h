// The plots that the page and the certificate of a lamp share.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/cli/svg/svg_isolux.h"
#include "luxfield/photometry/answers.h"

namespace luxfield::cli {

// What the plots of IntensityPlots need said beside them.
constexpr const char* kIntensityPlotsNote =
    "gamma counts from the lamp's +z axis, downwards in the diagram; C0 is +u and C90 is -v of the "
    "luminaire's frame. In the plots positive gamma lies on the side of the second plane named.";

// Intensity in the planes C0-C180 and C90-C270, polar and Cartesian, as SVG; `whole_sphere`: up to
// gamma = 180, else 90, and where the lamp shines less far little farther than it does.
std::vector<std::string> IntensityPlots(const photometry::Lamp& lamp, bool whole_sphere);

// The solid of intensity: from the origin as far in each direction as intensity is large, up to the
// same gamma.
std::string SolidOf(const photometry::Lamp& lamp, bool whole_sphere);

// A plane with isolux lines; one along the frame's axes shows its coordinates.
IsoluxMap IsoluxOf(const photometry::PlaneAnswer& answer, const PhotometryNames& names);

}  // namespace luxfield::cli
