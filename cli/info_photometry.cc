#include "luxfield/cli/info_photometry.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/photometric_file.h"

namespace luxfield::cli {
namespace {

std::string TypeName(formats::PhotometryType type) {
  return type == formats::PhotometryType::kC   ? "C"
         : type == formats::PhotometryType::kB ? "B"
                                               : "A";
}

std::string ShapeName(formats::Opening::Shape shape) {
  using enum formats::Opening::Shape;
  switch (shape) {
    case kPoint:
      return "point";
    case kBox:
      return "box";
    case kEllipse:
      return "ellipse";
    case kCylinderAlongC0:
      return "cylinder along C0";
    case kCylinderAlongC90:
      return "cylinder along C90";
    case kEllipsoid:
      return "ellipsoid";
    case kVerticalDisc:
      return "vertical disc";
  }
  return {};
}

void Print(const std::string& path, const formats::Photometry& p, double flux,
           const formats::Peak& peak, const std::string& symmetry) {
  fmt::print("{}: photometric file, {}, type {}, {} photometry\n", path, p.format, TypeName(p.type),
             p.absolute ? "absolute" : "relative");
  for (const char* key : {"MANUFAC", "LUMINAIRE", "LUMCAT"})
    if (!p.keyword(key).empty()) fmt::print("  {:<12} {}\n", key, core::OnOneLine(p.keyword(key)));
  fmt::print("  table        {} planes, {} angles from {:g} to {:g} degrees\n", p.planes_deg.size(),
             p.angles_deg.size(), p.angles_deg.front(), p.angles_deg.back());
  fmt::print("  flux         {:.6g} lm by integration", flux);
  if (p.stated_flux_lm)
    fmt::print("; {:.6g} lm by the header ({:+.2f} %)", *p.stated_flux_lm,
               *p.stated_flux_lm > 0 ? 100 * (flux / *p.stated_flux_lm - 1) : 0.0);
  if (p.lamp_flux_lm)
    fmt::print("; {:.6g} lm of the bare lamps ({:.2f} % leave it)", *p.lamp_flux_lm,
               *p.lamp_flux_lm > 0 ? 100 * flux / *p.lamp_flux_lm : 0.0);
  fmt::print("\n  peak         {:.6g} cd at {} {:g}, {} {:g}\n", peak.intensity_cd,
             p.type == formats::PhotometryType::kC ? "C" : "H", peak.plane_deg,
             p.type == formats::PhotometryType::kC ? "gamma" : "V", peak.angle_deg);
  fmt::print("  opening      {}\n  symmetry     {}\n", formats::Describe(p.opening), symmetry);
}

std::string Millimetres(lightfield::Vec3 p) {
  return fmt::format("({:.5g}, {:.5g}, {:.5g}) mm", 1e3 * p.x, 1e3 * p.y, 1e3 * p.z);
}

// Without a sign of zeros.
std::string Towards(lightfield::Vec3 d) {
  const auto rounded = [](double x) { return std::round(1e4 * x) / 1e4 + 0.0; };
  return fmt::format("({:g}, {:g}, {:g})", rounded(d.x), rounded(d.y), rounded(d.z));
}

core::Json ShapeJson(const formats::LampShape& shape) {
  const auto list = [](lightfield::Vec3 v) { return core::Json{v.x, v.y, v.z}; };
  core::Json objects = core::Json::array(), surfaces = core::Json::array();
  for (const auto& object : shape.objects)
    objects.push_back({{"name", object.name},
                       {"shape", object.round ? "disc" : "rectangle"},
                       {"x_m", object.x_m},
                       {"y_m", object.y_m},
                       {"luminous_heights_m", object.heights_m},
                       {"centre_m", list(object.centre_m)},
                       {"x_axis", list(object.x_axis)},
                       {"direction", list(object.direction)}});
  for (const auto& surface : shape.surfaces)
    surfaces.push_back({{"name", surface.name},
                        {"objects", surface.objects},
                        {"faces", surface.faces},
                        {"area_m2", surface.area_m2},
                        {"direction", list(surface.direction)}});
  return {{"objects", std::move(objects)}, {"surfaces", std::move(surfaces)}};
}

void Print(const formats::LampShape& shape) {
  for (const auto& object : shape.objects)
    fmt::print("  shines       {}: {} at {}, towards {}\n", core::OnOneLine(object.name),
               object.round ? fmt::format("a disc of {:.5g} mm", 1e3 * object.x_m)
                            : fmt::format("a rectangle of {:.5g} mm x {:.5g} mm", 1e3 * object.x_m,
                                          1e3 * object.y_m),
               Millimetres(object.centre_m), Towards(object.direction));
  for (const auto& surface : shape.surfaces)
    fmt::print("  surface      {}: {} faces of {:.5g} cm^2, towards {}\n",
               core::OnOneLine(surface.name), surface.faces, 1e4 * surface.area_m2,
               Towards(surface.direction));
}

// A container's photometry is told whatever its L3D is.
std::optional<formats::LampShape> ShapeInContainer(const std::string& path,
                                                   formats::Photometry& p) {
  if (!p.format.starts_with("GLDF")) return {};
  try {
    auto shape = formats::ReadLampShape(path);
    if (shape) p.odd.insert(p.odd.end(), shape->odd.begin(), shape->odd.end());
    return shape;
  } catch (const InputError& error) {
    p.odd.push_back(fmt::format("its L3D is not read: {}", error.what()));
    return {};
  }
}

}  // namespace

core::Json InfoLampShape(const std::string& path) {
  const auto shape = formats::ReadLampShape(path);
  if (!shape) throw InputError(path, "is no ZIP archive, as L3D is", "have it exported anew");
  fmt::print("{}: luminaire geometry, L3D, {} light-emitting object{}\n", path,
             shape->objects.size(), shape->objects.size() == 1 ? "" : "s");
  Print(*shape);
  for (const std::string& odd : shape->odd) fmt::print("  odd          {}\n", odd);
  core::Json json = ShapeJson(*shape);
  json.update({{"kind", "lamp shape"}, {"odd", shape->odd}});
  return json;
}

core::Json InfoPhotometry(const std::string& path) {
  formats::Photometry p = formats::ReadPhotometry(path);
  const auto shape = ShapeInContainer(path, p);
  const double flux = formats::Flux(p);
  const formats::Peak peak = formats::FindPeak(p);
  const std::string symmetry = formats::Describe(formats::FindSymmetry(p));
  Print(path, p, flux, peak, symmetry);
  if (shape) Print(*shape);
  for (const std::string& odd : p.odd) fmt::print("  odd          {}\n", core::OnOneLine(odd));
  core::Json keywords = core::Json::array();
  for (const auto& [key, text] : p.keywords) keywords.push_back({key, text});
  core::Json json = {{"kind", "photometry"},
                     {"format", p.format},
                     {"type", TypeName(p.type)},
                     {"absolute", p.absolute},
                     {"planes", p.planes_deg.size()},
                     {"angles", p.angles_deg.size()},
                     {"flux_lm", flux},
                     {"peak",
                      {{"intensity_cd", peak.intensity_cd},
                       {"plane_deg", peak.plane_deg},
                       {"angle_deg", peak.angle_deg}}},
                     {"opening",
                      {{"shape", ShapeName(p.opening.shape)},
                       {"c0_m", p.opening.c0_m},
                       {"c90_m", p.opening.c90_m},
                       {"height_m", p.opening.height_m}}},
                     {"symmetry", symmetry},
                     {"input_watts", p.input_watts},
                     {"lamp_sets", p.lamps.size()},
                     {"keywords", std::move(keywords)},
                     {"odd", p.odd}};
  if (shape) json["shape"] = ShapeJson(*shape);
  if (p.stated_flux_lm) json["stated_flux_lm"] = *p.stated_flux_lm;
  if (p.lamp_flux_lm) json["lamp_flux_lm"] = *p.lamp_flux_lm;
  return json;
}

}  // namespace luxfield::cli
