// ask.toml (docs/photometry.md): at which points and on which planes a lamp's light is asked for.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/config.h"
#include "luxfield/lightfield/geometry.h"
#include "luxfield/photometry/point_receiver.h"
#include "luxfield/photometry/regulation.h"

namespace luxfield::photometry {

// A quantity that channels are weighed into, as photons are of watts:
//
//   Q = sum over channels of factor times E
struct Weighting {
  std::string name;
  std::string unit;             // of Q, "umol/(m2 s)"
  std::vector<double> factors;  // in `unit` for lx, W/m^2 or a relative one of each channel
};

// All in the luminaire's frame, metres; directions are unit vectors. `weighting` names one of those
// asked for; empty: luminance, or the only channel.
struct PointAsked {
  std::string name;
  lightfield::Vec3 p_m;
  lightfield::Vec3 normal;                 // of illuminance, towards the lamp side
  lightfield::Vec3 axis;                   // of cylindrical and semicylindrical illuminance
  std::optional<lightfield::Vec3> facing;  // of semicylindrical illuminance, across the axis
  std::string weighting = {};
};

// Points at even steps along a line, both ends among them, each asked as a point is.
struct LineAsked {
  std::string name;
  lightfield::Vec3 from_m, to_m;
  int points = 0;
  std::optional<lightfield::Vec3> normal;  // absent: towards the origin from each point
  lightfield::Vec3 axis;
  std::optional<lightfield::Vec3> facing;
  std::string weighting = {};

  PointAsked Point(int k) const;
};

// columns x rows points in the middles of equal fields of a rectangle, and what takes in light there.
struct PlaneAsked {
  std::string name;
  lightfield::Vec3 centre_m, right, up;  // right and up at right angles
  double width_m = 0, height_m = 0;      // along right, along up
  int columns = 0, rows = 0;
  PointReceiver receiver = {};  // a plane's normal is Normal()
  std::string weighting = {};

  lightfield::Vec3 Point(int column, int row) const;  // row 0 at the top
  lightfield::Vec3 PointAt(std::size_t k) const;      // of [row][column]
  lightfield::Vec3 Normal() const;                    // to the side that the origin is on
  std::size_t count() const { return static_cast<std::size_t>(columns) * rows; }
};

// Planes behind each other along right x up, in the middles of equal slices of a depth.
struct VolumeAsked {
  PlaneAsked middle;
  double depth_m = 0;
  int layers = 0;

  PlaneAsked Layer(int k) const;
  lightfield::Vec3 PointAt(std::size_t k) const;  // of [layer][row][column]
  std::size_t count() const { return middle.count() * static_cast<std::size_t>(layers); }
};

// A receiver that moves: along straight lines from one place to the next, evenly in time. Normals of
// a plane turn by the shorter way (their linear mean, normalised); without any it faces the origin.
struct PathAsked {
  std::string name;
  PointReceiver receiver;
  std::string weighting = {};
  std::vector<double> times_s;  // rising
  std::vector<lightfield::Vec3> positions_m, normals;

  lightfield::Vec3 Position(double time_s) const;
  PointReceiver At(double time_s) const;  // the receiver as it is turned then
};

// What the picture of an eye shows: the lamp, in perspective; or half of all directions, about the line
// of sight, by angle (formats/lamp_view.h has both).
enum class EyePicture { kNone, kPerspective, kFisheye };

// Whose luminance is asked for.
struct EyeAsked {
  std::string name;
  lightfield::Vec3 eye_m;
  std::vector<double> fields_of_view_mrad;  // full angles
  double threshold = 0;                     // of the luminous area, cd/m^2
  EyePicture picture = EyePicture::kPerspective;
  // Where it looks, for glare, and of a fisheye picture; `up` is across, for the unified glare rating
  // and pictures.
  std::optional<lightfield::Vec3> line_of_sight;
  lightfield::Vec3 up;
  double age_years = 0;                  // of who looks, for the veiling luminance
  std::optional<double> background;      // cd/m^2, of the unified glare rating
  std::optional<double> road_luminance;  // cd/m^2, of the threshold increment
  // Width and height of the luminous opening on the filter plane, of the plain rating.
  std::optional<std::array<double, 2>> opening_m;
};

// A table of unified glare ratings: eyes below the lamp at distances from its axis, in C planes, that
// look horizontally towards the axis.
struct GlareAsked {
  std::string name;
  double below_m = 0;
  std::vector<double> distances_m, c_deg;
  double background = 0, threshold = 0;  // cd/m^2
  std::optional<std::array<double, 2>> opening_m;

  EyeAsked Eye(std::size_t plane, std::size_t distance) const;
};

// What a regulation is asked about.
struct HeadlampAsked {
  std::string name;
  Regulation regulation;  // for the side of the road that traffic is on
  lightfield::Vec3 forward, up;
  std::optional<Place> aim;  // where H = V = 0 lies; absent: as the regulation aims
  double height_m = 0;       // of the lamp above the road
  // Of the driver, from the lamp: to the right, above the road, and ahead.
  std::array<double, 3> eye_m{};
};

// [quality]: files of what the measurement's quality follows from (docs/photometry.md); empty: absent.
struct QualityAsked {
  std::filesystem::path responsivity, lamp_spectrum, calibration_spectrum, sensor_calibration;
};

// [certificate]: what a laboratory states of itself and its measurement, in its own words.
struct CertificateText {
  const char *key, *label;
};
inline constexpr std::array kCertificateTexts = {
    CertificateText{"number", "Certificate"},
    CertificateText{"laboratory", "Laboratory"},
    CertificateText{"address", "Address"},
    CertificateText{"customer", "Customer"},
    CertificateText{"lamp", "Lamp"},
    CertificateText{"serial_number", "Serial number"},
    CertificateText{"condition", "Condition when received"},
    CertificateText{"received", "Received"},
    CertificateText{"measured", "Measured"},
    CertificateText{"issued", "Issued"},
    CertificateText{"place", "Place of measurement"},
    CertificateText{"method", "Method"},
    CertificateText{"operating_conditions", "Operating conditions of the lamp"},
    CertificateText{"ambient_conditions", "Ambient conditions"},
    CertificateText{"traceability", "Traceability"},
    CertificateText{"approved_by", "Approved by"},
};

struct Asked {
  std::map<std::string, std::string> certificate;  // by key; what is not stated is absent
  std::vector<Weighting> weightings;
  QualityAsked quality;
  std::vector<HeadlampAsked> headlamps;
  std::vector<EyeAsked> eyes;
  std::vector<GlareAsked> glare;
  std::vector<PointAsked> points;
  std::vector<LineAsked> lines;
  std::vector<PlaneAsked> planes;
  std::vector<VolumeAsked> volumes;
  std::vector<PathAsked> paths;
};

// The file of a regulation that ask.toml names.
using RegulationFile = std::function<std::filesystem::path(const std::string& name)>;

// Throws InputError naming file and field.
Asked ReadAsked(const core::Config& config, const RegulationFile& regulation_file);

// An eye at a distance from the origin along +z that looks at the lamp, +v upwards, without glare.
EyeAsked EyeBefore(double distance_m);

// width x height m before the lamp at a distance from the origin along +z, facing it; right is +u and
// up is +v.
PlaneAsked PlaneBefore(double distance_m, double width_m, double height_m, int columns, int rows);

}  // namespace luxfield::photometry
