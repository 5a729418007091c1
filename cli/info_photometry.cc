#include "luxfield/cli/info_photometry.h"

#include <fmt/format.h>

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
  for (const std::string& odd : p.odd) fmt::print("  odd          {}\n", core::OnOneLine(odd));
}

}  // namespace

core::Json InfoPhotometry(const std::string& path) {
  const formats::Photometry p = formats::ReadPhotometry(path);
  const double flux = formats::Flux(p);
  const formats::Peak peak = formats::FindPeak(p);
  const std::string symmetry = formats::Describe(formats::FindSymmetry(p));
  Print(path, p, flux, peak, symmetry);
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
  if (p.stated_flux_lm) json["stated_flux_lm"] = *p.stated_flux_lm;
  if (p.lamp_flux_lm) json["lamp_flux_lm"] = *p.lamp_flux_lm;
  return json;
}

}  // namespace luxfield::cli
