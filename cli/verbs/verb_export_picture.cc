// luxfield export X.lf.exr -o X.hdr, X.exr: the lamp as an eye sees it, or its light on a plane.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "luxfield/cli/verbs/verb_export.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/radiance_hdr.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/lamp_view.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using formats::Eye;
using lightfield::Vec3;

// Radiance's lumens per watt ("The RADIANCE File Formats"): its pixels are W sr^-1 m^-2.
constexpr double kRadianceEfficacy = 179;
// Largest step between a Radiance picture's values, halved, and float32's.
constexpr double kHdrStep = 1.0 / 256, kExrStep = 1e-6;

bool IsPlane(const ExportOptions& options) { return options.view == "plane"; }

Vec3 PointOf(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

// On the first field's axis where no eye is named.
Eye EyeOf(const ExportOptions& options, const Fields& fields) {
  Eye eye;
  if (options.view == "fisheye") eye.projection = Eye::Projection::kFisheye;
  if (options.view == "equirectangular") eye.projection = Eye::Projection::kEquirectangular;
  const double distance =
      options.distance_m.value_or(std::max(1.0, 4 * formats::ReachOfSupports(fields)));
  const auto& pose = fields.front().luminaire_from_field;
  eye.position_m =
      options.eye.empty() ? distance * pose.Direction({0, 0, 1}) : PointOf(options.eye);
  if (!options.look_at.empty()) eye.look_at_m = PointOf(options.look_at);
  if (!options.up.empty()) {
    eye.up = PointOf(options.up);
  } else if (options.eye.empty()) {
    eye.up = pose.Direction({0, 1, 0});
  }
  if (!options.size.empty()) eye.width = options.size[0], eye.height = options.size[1];
  eye.Validate();
  if (eye.projection == Eye::Projection::kFisheye) eye.fov_deg = 180;
  if (options.fov_deg)
    eye.fov_deg = *options.fov_deg;
  else if (eye.projection == Eye::Projection::kPerspective && !IsPlane(options))
    eye.fov_deg = formats::FovOfWholeLamp(eye, fields);
  if (eye.projection == Eye::Projection::kPerspective && !(eye.fov_deg <= 170))
    throw InputError(
        fmt::format("--fov {:g} is more than the 170 degrees of a perspective picture; "
                    "choose --view fisheye",
                    eye.fov_deg));
  return eye;
}

std::string UnitOfPixels(const std::string& flux_unit, bool plane) {
  if (flux_unit == "lm") return plane ? "lx" : "cd/m^2";
  return flux_unit + (plane ? "/m^2" : "/(sr m^2)");
}

// Of a Radiance picture: the luminance in all three channels, as Radiance counts it; what is
// negative becomes 0.
core::Image ForRadiance(const core::Image& image, double scale, double& negative_share) {
  core::Image out(image.width, image.height, 1);
  double positive = 0, negative = 0;
  for (std::size_t k = 0; k < out.data.size(); ++k) {
    const double light =
        image.channels == 1
            ? image.data[k]
            : core::Luminance({image.plane(0)[k], image.plane(1)[k], image.plane(2)[k]});
    (light > 0 ? positive : negative) += std::abs(light);
    out.data[k] = static_cast<float>(std::max(0.0, light) / scale);
  }
  negative_share = positive > 0 ? negative / positive : 0;
  return out;
}

struct Written {
  double scale = 1;  // the file's value times this is in the unit of pixels
  double negative_share = 0;
};

Written WriteHdr(const ExportOptions& options, const core::Image& image,
                 const std::string& flux_unit, const std::optional<std::string>& view) {
  Written written;
  const bool luminous = flux_unit == "lm";
  if (luminous) written.scale = kRadianceEfficacy;
  const core::Image out = ForRadiance(image, written.scale, written.negative_share);
  const std::string unit = UnitOfPixels(flux_unit, IsPlane(options));
  core::WriteRadianceHdr(
      options.output, out,
      {"luxfield " LUXFIELD_VERSION ", light field " +
           std::filesystem::path(options.field).filename().string(),
       luminous ? fmt::format("{} = 179 x value, as in all Radiance pictures", unit)
                : fmt::format("values in {}", unit)},
      view.value_or(std::string()));
  return written;
}

Written WriteExr(const ExportOptions& options, const core::Image& image,
                 const std::string& flux_unit) {
  core::WriteExrImage(options.output, image,
                      {{"luxfield:unit", UnitOfPixels(flux_unit, IsPlane(options))},
                       {"luxfield:provenance.light_field",
                        std::filesystem::path(options.field).filename().string()}});
  return {};
}

core::Image ReadBack(const ExportOptions& options, const ExportFormat& format,
                     const Written& written) {
  const auto path = core::ReadableAt(options.output);
  core::Image image = format.name == "hdr" ? core::ReadRadianceHdr(path) : core::ReadExrImage(path);
  for (float& value : image.data) value *= static_cast<float>(written.scale);
  return image;
}

double LargestLuminance(const core::Image& image) {
  double largest = 0;
  for (std::size_t k = 0; k < image.plane_size(); ++k)
    largest = std::max(
        largest, image.channels == 1
                     ? double{image.data[k]}
                     : core::Luminance({image.plane(0)[k], image.plane(1)[k], image.plane(2)[k]}));
  return largest;
}

}  // namespace

core::Json ExportPicture(const ExportOptions& options, const ExportFormat& format,
                         const Fields& fields) {
  const Eye eye = EyeOf(options, fields);
  const std::string flux_unit = UnitOf(fields);
  const bool plane = IsPlane(options);
  const double distance = lightfield::Length(eye.position_m - eye.look_at_m);
  const std::vector<double> extent =
      options.extent_m.empty() ? std::vector{2 * distance, 2 * distance * eye.height / eye.width}
                               : options.extent_m;
  formats::LampPicture picture;
  if (plane)
    picture.image = formats::DrawIrradiance(fields, eye, extent[0], extent[1]);
  else
    picture =
        formats::DrawLamp(fields, eye, options.samples.value_or(kDefaultSamples), options.seed);
  const bool hdr = format.name == "hdr";
  const Written written =
      hdr ? WriteHdr(options, picture.image, flux_unit,
                     plane ? std::optional<std::string>() : formats::RadianceView(eye))
          : WriteExr(options, picture.image, flux_unit);

  const std::string unit = UnitOfPixels(flux_unit, plane);
  const double largest = LargestLuminance(picture.image);
  fmt::print("{}: {} of {} x {} pixels, at most {:.6g} {}\n", options.output,
             plane ? "irradiance on a plane" : options.view + " picture", eye.width, eye.height,
             largest, unit);
  fmt::print("  from         ({:.5g}, {:.5g}, {:.5g}) m towards ({:.5g}, {:.5g}, {:.5g}) m, {}\n",
             eye.position_m.x, eye.position_m.y, eye.position_m.z, eye.look_at_m.x, eye.look_at_m.y,
             eye.look_at_m.z,
             plane ? fmt::format("{:.5g} m x {:.5g} m", extent[0], extent[1])
             : eye.projection == Eye::Projection::kEquirectangular
                 ? std::string("all directions")
                 : fmt::format("{:.5g} degrees", eye.fov_deg));
  if (written.negative_share > 0)
    fmt::print(
        "  negative     {:.3g} % of the picture's light is negative, which .hdr cannot hold, "
        "and 0 there\n",
        100 * written.negative_share);
  core::Json json = {{"format", format.name},
                     {"view", options.view},
                     {"width", eye.width},
                     {"height", eye.height},
                     {"unit", unit},
                     {"largest", largest},
                     {"eye_m", {eye.position_m.x, eye.position_m.y, eye.position_m.z}},
                     {"negative_share", written.negative_share}};
  if (plane)
    json["extent_m"] = extent;
  else if (eye.projection != Eye::Projection::kEquirectangular)
    json["fov_deg"] = eye.fov_deg;
  if (options.check) {
    const core::Image read = ReadBack(options, format, written);
    const double step = (hdr ? kHdrStep : kExrStep) + 2 * written.negative_share;
    json["check"] = ReportChecks(
        options, format,
        {plane
             ? formats::CheckIrradiance(read, eye, extent[0], extent[1], fields, step, options.seed)
             : formats::CheckLampPicture(read, eye, picture.irradiance_sigma, fields, step,
                                         options.output)});
  }
  return json;
}

}  // namespace luxfield::cli
