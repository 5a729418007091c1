#include "luxfield/reconstruct/calibrate/mirror_ball/probe_description.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

namespace luxfield::reconstruct {
namespace {

using core::Config;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kTiny = 1e-300;  // "above 0" as a closed range

// [all] or [R, G, B]; 1 where it is left out.
core::Rgb RgbOf(const Config& table, const std::string& key, double most) {
  const std::vector<double> values = table.Numbers(key, 0, {1});
  for (const double value : values)
    if (!(value > 0 && value <= most))
      table.Fail(key, fmt::format("holds {}", value), fmt::format("above 0 and up to {}", most));
  if (values.size() == 1) return {values[0], values[0], values[0]};
  if (values.size() != 3)
    table.Fail(key, fmt::format("has {} numbers", values.size()), "give one, or three for R, G, B");
  return {values[0], values[1], values[2]};
}

rig::SensorModel ReadCamera(const Config& camera) {
  rig::SensorModel sensor;
  sensor.gain_dn_per_e = camera.Number("gain_dn_per_e", {kTiny});
  sensor.saturation_dn = camera.Number("saturation_dn", {kTiny});
  sensor.black_dn = camera.Number("black_dn", 0, {});
  sensor.read_noise_dn = camera.Number("read_noise_dn", 0, {0});
  sensor.dark_current_e_per_s = camera.Number("dark_current_e_per_s", 0, {0});
  sensor.prnu = camera.Number("prnu", 0, {0, 1});
  return sensor;
}

void ReadBall(const Config& probe, const Config& root, ProbeDescription& description) {
  ProbeOptics& optics = description.optics;
  optics.camera = LevelCamera(probe.Number("azimuth_deg", 180, {}),
                              probe.Number("elevation_deg", 0, {-90, 90}));
  const core::Rgb reflectance = RgbOf(probe, "reflectance", 1);
  for (std::size_t k = 0; k < 3; ++k) description.radiance_per_rate[k] /= reflectance[k];
  const auto perspective = root.OptionalTable("perspective");
  if (!perspective) return;
  const double distance = perspective->Number("distance_m", {kTiny});
  const double diameter = perspective->Number("diameter_m", {kTiny});
  if (!(diameter < 2 * distance))
    perspective->Fail("distance_m", fmt::format("lies inside the ball of diameter {}", diameter),
                      "give the distance to the ball's centre");
  optics.half_angle = std::asin(0.5 * diameter / distance);
  if (perspective->Has("principal_point_px")) {
    const auto point = perspective->Numbers("principal_point_px", 2);
    optics.principal_point = {point[0], point[1]};
    description.has_principal_point = true;
  }
}

void ReadFisheye(const Config& probe, const Config& root, ProbeDescription& description) {
  ProbeOptics& optics = description.optics;
  optics.kind = ProbeOptics::Kind::kFisheye;
  optics.camera = UpwardCamera(probe.Number("azimuth_deg", 0, {}));
  const Config lens = root.Table("lens");
  const std::string projection = lens.Choice(
      "projection", {"equidistant", "equisolid", "stereographic", "orthographic"}, "equidistant");
  using enum FisheyeProjection;
  optics.projection = projection == "equidistant"     ? kEquidistant
                      : projection == "equisolid"     ? kEquisolid
                      : projection == "stereographic" ? kStereographic
                                                      : kOrthographic;
  const double most = optics.projection == kOrthographic ? 180 : 350;
  optics.field_of_view = kDegree * lens.Number("field_of_view_deg", 180, {1, most});
}

// Refuses what cameras develop, and what is no picture that is read here.
void RequireLinear(const std::string& bytes, const std::string& file) {
  if (bytes.starts_with("\xFF\xD8") || bytes.starts_with("\x89PNG"))
    throw InputError(
        file, "is a JPEG or PNG, whose codes are a camera's development of radiance",
        "find the camera's curve (`luxfield calibrate response`), merge the pictures "
        "(`luxfield merge IMAGES -o X.exr --calibration X.cal.json`) and name X.exr as "
        "[probe] merged, without [camera] and [[exposure]]");
  if (!bytes.starts_with("II") && !bytes.starts_with("MM"))
    throw InputError(file, "is neither TIFF nor OpenEXR",
                     "give linear pictures: TIFF without compression (`dcraw -4 -T`) or OpenEXR");
}

ProbeExposure ReadExposure(const Config& table) {
  ProbeExposure exposure;
  if (table.Has("file"))
    exposure.files = {table.Path("file")};
  else
    exposure.files = {table.Path("red"), table.Path("green"), table.Path("blue")};
  exposure.exposure_s = table.Number("exposure_s", {kTiny});
  if (table.Has("nd_stops") && table.Has("attenuation"))
    table.Fail("nd_stops", "is given beside attenuation", "give one of them");
  exposure.attenuation = table.Has("nd_stops") ? std::exp2(-table.Number("nd_stops", {0, 60}))
                                               : table.Number("attenuation", 1, {kTiny, 1});
  return exposure;
}

}  // namespace

ProbeDescription ReadProbeDescription(const std::filesystem::path& path) {
  const Config root = Config::FromFile(path);
  const Config probe = root.Table("probe");
  ProbeDescription description;
  description.file = path;
  description.radiance_per_rate = RgbOf(probe, "radiance_per_rate", 1e30);
  description.unit = probe.Text("unit", "relative");
  description.margin_px = probe.Number("margin_px", 2, {0, 1000});
  if (probe.Has("mask")) description.mask = probe.Path("mask");
  if (probe.Choice("kind", {"mirror-ball", "fisheye"}) == "mirror-ball")
    ReadBall(probe, root, description);
  else
    ReadFisheye(probe, root, description);
  if (probe.Has("merged")) {
    description.merged = probe.Path("merged");
    if (root.Has("exposure"))
      root.Fail("exposure", "is given beside [probe] merged", "give one of them");
    description.take_lower_bounds =
        probe.Choice("saturated", {"refuse", "lower-bound"}, "refuse") == "lower-bound";
  } else {
    description.sensor = ReadCamera(root.Table("camera"));
  }
  if (const auto rim = root.OptionalTable("rim")) {
    const auto centre = rim->Numbers("centre_px", 2);
    description.start = Circle{centre[0], centre[1], rim->Number("radius_px", {8, 1e5})};
  }
  if (!description.merged) {
    for (const Config& table : root.Tables("exposure"))
      description.exposures.push_back(ReadExposure(table));
    if (description.exposures.empty())
      root.Fail("exposure", "is missing",
                "add an [[exposure]] for each picture, or [probe] merged");
  }
  root.Finish();
  return description;
}

std::vector<session::RawFrame> ReadProbePicture(const ProbeExposure& exposure) {
  std::vector<session::RawFrame> channels;
  for (const auto& path : exposure.files) {
    std::vector<session::RawFrame> planes;
    if (path.extension() == ".exr") {
      if (IsMergedPicture(path))
        throw InputError(path.string(), "is a merged picture and no exposure of a linear camera",
                         "name it as [probe] merged, without [camera] and [[exposure]]");
      const core::Image image = core::ReadExrImage(path);
      for (int c = 0; c < image.channels; ++c) {
        const auto plane = image.plane(c);
        planes.push_back({image.width, image.height, {}, {plane.begin(), plane.end()}});
      }
    } else {
      const std::string bytes = core::ReadFile(path);
      RequireLinear(bytes, path.string());
      planes = session::DecodeTiffChannels(bytes, path.string());
    }
    if (exposure.files.size() == 3 && planes.size() != 1)
      throw InputError(path.string(), fmt::format("has {} channels", planes.size()),
                       "red, green and blue are pictures of one channel each");
    for (auto& plane : planes) {
      if (!channels.empty() &&
          (plane.width != channels[0].width || plane.height != channels[0].height))
        throw InputError(path.string(),
                         fmt::format("is {} x {} pixels, its red one {} x {}", plane.width,
                                     plane.height, channels[0].width, channels[0].height),
                         "the channels of an exposure must agree");
      channels.push_back(std::move(plane));
    }
  }
  return channels;
}

}  // namespace luxfield::reconstruct
