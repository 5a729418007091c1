#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "luxfield/core/error.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/formats/xml.h"

namespace luxfield::formats {
namespace {

constexpr const char* kNoDate = "0001-01-01";

// 2024-06-21, as xs:date.
bool IsDate(const std::string& text) {
  if (text.size() != 10) return false;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (k == 4 || k == 7 ? text[k] != '-' : !std::isdigit(static_cast<unsigned char>(text[k])))
      return false;
  return text.substr(5, 2) >= "01" && text.substr(5, 2) <= "12" && text.substr(8) >= "01" &&
         text.substr(8) <= "31";
}

class Writer {
 public:
  std::string Take() { return std::move(text_); }

  void Open(const char* name) {
    text_ += fmt::format("{:{}}<{}>\n", "", 2 * open_.size(), name);
    open_.push_back(name);
  }
  void Close() {
    const char* name = open_.back();
    open_.pop_back();
    text_ += fmt::format("{:{}}</{}>\n", "", 2 * open_.size(), name);
  }
  void Text(const char* name, std::string_view text) {
    text_ += fmt::format("{:{}}<{}>{}</{}>\n", "", 2 * open_.size(), name, XmlEscaped(text), name);
  }
  // xs:decimal has no exponent.
  void Number(const char* name, double value) {
    std::string digits = fmt::format("{:.9f}", value);
    digits.erase(digits.find_last_not_of('0') + 1);
    if (digits.ends_with('.')) digits.pop_back();
    Text(name, digits);
  }
  void Intensity(double plane, double angle, double value) {
    text_ += fmt::format("{:{}}<IntData h=\"{:.7g}\" v=\"{:.7g}\">{:.7g}</IntData>\n", "",
                         2 * open_.size(), plane, angle, value);
  }

 private:
  std::string text_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  std::vector<const char*> open_;
};

void WriteHeader(Writer& xml, const Photometry& p) {
  constexpr const char* kElements[] = {"MANUFAC", "LUMCAT", "LUMINAIRE",
                                       "TESTLAB", "TEST",   "ISSUEDATE"};
  const auto stated = [&](const char* key) {
    return p.keyword(key).empty() ? std::string("not stated") : p.keyword(key);
  };
  xml.Open("Header");
  if (!p.keyword("MANUFAC").empty()) xml.Text("Manufacturer", p.keyword("MANUFAC"));
  if (!p.keyword("LUMCAT").empty()) xml.Text("CatalogNumber", p.keyword("LUMCAT"));
  xml.Text("Description", stated("LUMINAIRE"));
  xml.Text("Laboratory", stated("TESTLAB"));
  xml.Text("ReportNumber", stated("TEST"));
  const std::string date = p.keyword("ISSUEDATE");
  xml.Text("ReportDate", IsDate(date) ? date : kNoDate);
  for (const auto& [key, text] : p.keywords) {
    const bool written =
        std::find(std::begin(kElements), std::end(kElements), key) != std::end(kElements) &&
        (key != "ISSUEDATE" || IsDate(text));
    if (!written) xml.Text("Comment", key.empty() || key == "OTHER" ? text : key + ": " + text);
  }
  xml.Close();
}

void WriteLuminaire(Writer& xml, const Photometry& p) {
  xml.Open("Luminaire");
  xml.Open("Dimensions");
  const bool housing = p.housing_m[0] > 0;
  xml.Number("Length", housing ? p.housing_m[0] : p.opening.c0_m);
  xml.Number("Width", housing ? p.housing_m[1] : p.opening.c90_m);
  xml.Number("Height", housing ? p.housing_m[2] : p.opening.height_m);
  xml.Close();
  xml.Text("NumEmitter", "1");
  xml.Close();
  xml.Open("Equipment");
  xml.Open("Gonioradiometer");
  xml.Text("Type", p.type == PhotometryType::kC   ? "IES_C"
                   : p.type == PhotometryType::kB ? "IES_B"
                                                  : "IES_A");
  xml.Close();
  xml.Close();
}

const char* SymmetryOf(const Photometry& p, const PlaneRange& range) {
  if (p.type != PhotometryType::kC || range.last == 360) return "Symm_None";
  if (range.last == 0) return "Symm_Full";
  if (range.last == 90) return "Symm_Quad";
  return range.first == 0 ? "Symm_Bi_0" : "Symm_Bi_90";
}

void WriteIntensities(Writer& xml, const Photometry& p, const std::string& file) {
  const bool c = p.type == PhotometryType::kC;
  const PlaneRange range = c ? StoredRange(p) : PlaneRange{-180, 180};
  std::vector<std::pair<double, std::size_t>> planes;  // angle, index in the table
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    if (p.planes_deg[k] >= range.first - 1e-6 && p.planes_deg[k] <= range.last + 1e-6)
      planes.emplace_back(p.planes_deg[k], k);
  if (c && range.last == 360) {
    if (planes.empty() || planes.front().first != 0)
      throw InputError(file, "TM-33 asks for a plane C0, which the table has not",
                       "sample it anew");
    planes.emplace_back(360, 0);
  }
  xml.Open("LuminousIntensity");
  xml.Text("AbsolutePhotometry", p.absolute ? "true" : "false");
  xml.Text("Symm", SymmetryOf(p, range));
  xml.Text("NumberMeasured", fmt::format("{}", planes.size() * p.angles_deg.size()));
  xml.Text("NumberHorz", fmt::format("{}", planes.size()));
  xml.Text("NumberVert", fmt::format("{}", p.angles_deg.size()));
  for (const auto& [plane, k] : planes)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j)
      xml.Intensity(plane, p.angles_deg[j], p.at(k, j));
  xml.Close();
}

void WriteOpening(Writer& xml, const Opening& opening) {
  if (opening.shape == Opening::Shape::kPoint || !(opening.c0_m > 0 && opening.c90_m > 0)) return;
  const bool circular = opening.shape == Opening::Shape::kEllipse;
  xml.Open("EmissionAreas");
  xml.Open("BottomFace");
  xml.Text("NumberBottom", "1");
  xml.Open("BottomArea");
  xml.Number("Length", opening.c0_m);
  xml.Number("Width", opening.c90_m);
  xml.Number("LengthOffset", 0);
  xml.Number("WidthOffset", 0);
  if (circular) xml.Text("Circular", "true");
  xml.Close();
  xml.Close();
  xml.Close();
}

}  // namespace

std::string FormatTm33(const Photometry& p, const std::string& file) {
  Validate(p, file);
  Writer xml;
  xml.Open("IESTM33-22");
  xml.Text("Version", "1.1");
  WriteHeader(xml, p);
  WriteLuminaire(xml, p);
  xml.Open("Emitter");
  const LampSet lamps = p.lamps.empty() ? LampSet{} : p.lamps.front();
  xml.Text("Quantity", fmt::format("{}", std::max(1, lamps.count)));
  xml.Text("Description", lamps.type.empty() ? "not stated" : lamps.type);
  if (lamps.flux_lm > 0) xml.Number("RatedLumens", lamps.flux_lm);
  xml.Number("InputWattage", p.input_watts);
  xml.Open("LuminousData");
  WriteIntensities(xml, p, file);
  xml.Number("LuminousFlux", p.stated_flux_lm.value_or(Flux(p)));
  xml.Close();
  WriteOpening(xml, p.opening);
  xml.Close();
  xml.Close();
  return xml.Take();
}

}  // namespace luxfield::formats
