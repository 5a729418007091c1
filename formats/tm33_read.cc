#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/core/range.h"
#include "luxfield/formats/text_reader.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/formats/xml.h"

namespace luxfield::formats {
namespace {

// Elements of a header and the keywords of LM-63 that say the same.
constexpr std::pair<const char*, const char*> kHeaderKeywords[] = {
    {"Manufacturer", "MANUFAC"}, {"CatalogNumber", "LUMCAT"}, {"Description", "LUMINAIRE"},
    {"Laboratory", "TESTLAB"},   {"ReportNumber", "TEST"},    {"ReportDate", "ISSUEDATE"}};

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Photometry Read(const XmlElement& root) {
    Photometry p;
    p.format = root.name == "IESTM33-22"          ? "TM-33-23"
               : root.name.starts_with("IESTM33") ? "TM-33-18"
                                                  : "ATLA S001";
    ReadHeader(root, p);
    ReadLuminaire(root, p);
    const XmlElement& emitter = EmitterOf(root, p);
    ReadEmitter(emitter, p);
    ReadIntensities(root, emitter, p);
    return p;
  }

 private:
  [[noreturn]] void Fail(const XmlElement& element, const std::string& problem) const {
    throw InputError(file_, fmt::format("line {}: {}", element.line, problem),
                     "have it exported anew");
  }

  double Number(const XmlElement& element, std::string_view text, const char* what) const {
    double value = 0;
    text = Trimmed(text);
    if (text.starts_with("+")) text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !core::Range{}.Holds(value))
      Fail(element, fmt::format("{} '{}' is no number", what, core::Printable(std::string(text))));
    return value;
  }

  // None where there is no such child.
  std::optional<double> NumberOf(const XmlElement& parent, const char* name) const {
    const XmlElement* element = parent.child(name);
    if (!element) return {};
    return Number(*element, element->text, name);
  }

  double Metres(const XmlElement& parent, const char* name) const {
    const double metres = NumberOf(parent, name).value_or(0);
    if (!(metres >= 0 && metres <= 1e6))
      Fail(parent, fmt::format("{} = {:g} m is none", name, metres));
    return metres;
  }

  void ReadHeader(const XmlElement& root, Photometry& p) const {
    const XmlElement* header = root.child("Header");
    if (!header) return;
    for (const XmlElement& element : header->children) {
      if (element.text.empty()) continue;
      const auto known = std::find_if(std::begin(kHeaderKeywords), std::end(kHeaderKeywords),
                                      [&](const auto& pair) { return element.name == pair.first; });
      if (known != std::end(kHeaderKeywords))
        p.keywords.emplace_back(known->second, element.text);
      else
        p.keywords.emplace_back(element.name.starts_with("Comment") ? "OTHER" : "_" + element.name,
                                element.text);
    }
  }

  void ReadLuminaire(const XmlElement& root, Photometry& p) const {
    const XmlElement* size = root.at({"Luminaire", "Dimensions"});
    if (size)
      p.housing_m = {Metres(*size, "Length"), Metres(*size, "Width"), Metres(*size, "Height")};
  }

  // The first one with intensities.
  const XmlElement& EmitterOf(const XmlElement& root, Photometry& p) const {
    const XmlElement* found = nullptr;
    int count = 0;
    for (const XmlElement& emitter : root.children) {
      if (emitter.name != "Emitter") continue;
      if (!IntensitiesOf(emitter)) continue;
      if (!found) found = &emitter;
      ++count;
    }
    if (!found) {
      const bool photons =
          std::any_of(root.children.begin(), root.children.end(),
                      [](const auto& e) { return e.child("PhotonData") != nullptr; });
      throw InputError(file_,
                       photons ? "holds photon intensities (micromol/(s sr)), no luminous ones"
                               : "holds no luminous or radiant intensities",
                       "have it exported with them");
    }
    if (count > 1)
      p.odd.push_back(
          fmt::format("it has {} emitters with intensities; the first is taken", count));
    return *found;
  }

  static const XmlElement* IntensitiesOf(const XmlElement& emitter) {
    const std::initializer_list<std::string_view> paths[] = {{"LuminousData", "LuminousIntensity"},
                                                             {"IntensityDistribution"},
                                                             {"LuminousData"},
                                                             {"RadiantData", "RadiantIntensity"}};
    for (const auto& path : paths) {
      const XmlElement* element = emitter.at(path);
      if (element && (element->child("IntData") || element->child("IntensityData"))) return element;
    }
    return nullptr;
  }

  void ReadEmitter(const XmlElement& emitter, Photometry& p) const {
    p.input_watts =
        NumberOf(emitter, "InputWattage").value_or(NumberOf(emitter, "InputWatts").value_or(0));
    LampSet set;
    set.type = emitter.text_of("Description");
    set.watts = p.input_watts;
    set.flux_lm = NumberOf(emitter, "RatedLumens").value_or(0);
    const double quantity = NumberOf(emitter, "Quantity").value_or(1);
    if (quantity >= 1 && quantity <= 1e6) set.count = static_cast<int>(quantity);
    if (const XmlElement* cct = emitter.at({"ColorTemperature", "FixedCCT"}))
      set.colour = cct->text;
    p.lamps.push_back(std::move(set));
    if (const XmlElement* flux = emitter.at({"LuminousData", "LuminousFlux"}))
      p.stated_flux_lm = Number(*flux, flux->text, "LuminousFlux");
    if (const XmlElement* areas = emitter.child("EmissionAreas")) ReadOpening(*areas, p);
  }

  void ReadOpening(const XmlElement& emission, Photometry& p) const {
    std::string others;
    for (const XmlElement& face : emission.children)
      if (face.name != "BottomFace") others += (others.empty() ? "" : ", ") + face.name;
    if (!others.empty())
      p.odd.push_back(fmt::format("it emits from {}, too; only its bottom's area is told",
                                  core::Printable(others)));
    const XmlElement* face = emission.child("BottomFace");
    const XmlElement* area = face ? face->child("BottomArea") : nullptr;
    if (!area) return;
    const auto shape = Trimmed(area->text_of("Circular")) == "true" ? Opening::Shape::kEllipse
                                                                    : Opening::Shape::kBox;
    p.opening = {shape, Metres(*area, "Length"), Metres(*area, "Width"), 0};
    const auto areas = std::count_if(face->children.begin(), face->children.end(),
                                     [](const auto& e) { return e.name == "BottomArea"; });
    if (areas > 1)
      p.odd.push_back(fmt::format("its bottom has {} areas that emit; the first is told", areas));
    const double beside = std::hypot(NumberOf(*area, "LengthOffset").value_or(0),
                                     NumberOf(*area, "WidthOffset").value_or(0));
    if (beside > 0)
      p.odd.push_back(fmt::format("its area lies {:.4g} m beside the luminaire's middle", beside));
  }

  static PhotometryType TypeOf(const XmlElement& root, const XmlElement& intensities) {
    std::string type = intensities.text_of("PhotometryType");
    for (const char* device : {"Gonioradiometer", "Goniometer"})
      for (const char* name : {"Type", "GoniometerType"})
        if (const XmlElement* element = root.at({"Equipment", device, name});
            element && type.empty())
          type = element->text;
    if (type.ends_with("A")) return PhotometryType::kA;
    return type.ends_with("B") ? PhotometryType::kB : PhotometryType::kC;
  }

  double AngleOf(const XmlElement& datum, std::initializer_list<std::string_view> names,
                 const char* what) const {
    for (const auto& [name, value] : datum.attributes)
      if (std::find(names.begin(), names.end(), name) != names.end())
        return Number(datum, value, what);
    Fail(datum, fmt::format("an intensity has no {}", what));
  }

  void ReadIntensities(const XmlElement& root, const XmlElement& emitter, Photometry& p) const {
    const XmlElement& data = *IntensitiesOf(emitter);
    const std::string metric = data.text_of("Metric");
    if (metric == "Photon" || metric == "Spectral")
      Fail(data, fmt::format("its intensities are of Metric {}, not luminous", metric));
    p.type = TypeOf(root, data);
    std::string absolute = data.text_of("AbsolutePhotometry");
    if (absolute.empty()) absolute = data.text_of("Absolute");
    std::transform(absolute.begin(), absolute.end(), absolute.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    p.absolute = absolute != "false" && absolute != "0";
    const LampSet& set = p.lamps.front();
    if (!p.absolute && set.flux_lm > 0) p.lamp_flux_lm = set.flux_lm * set.count;
    const double multiplier = NumberOf(data, "Multiplier").value_or(1);
    if (!(multiplier > 0)) Fail(data, fmt::format("Multiplier = {:g} must be above 0", multiplier));

    std::vector<std::tuple<double, double, double>> values;
    for (const XmlElement& datum : data.children)
      if (datum.name == "IntData" || datum.name == "IntensityData")
        values.emplace_back(AngleOf(datum, {"h", "horz", "horizontal"}, "horizontal angle"),
                            AngleOf(datum, {"v", "vert", "vertical"}, "vertical angle"),
                            multiplier * Number(datum, datum.text, "an intensity"));
    std::sort(values.begin(), values.end());
    for (const auto& [h, v, value] : values) {
      if (p.planes_deg.empty() || h != p.planes_deg.back()) p.planes_deg.push_back(h);
      if (p.planes_deg.size() == 1) p.angles_deg.push_back(v);
      p.intensity_cd.push_back(value);
    }
    // Every plane has the angles of the first one.
    const std::size_t angles = p.angles_deg.size();
    bool whole = values.size() == p.planes_deg.size() * angles;
    for (std::size_t k = 0; whole && k < values.size(); ++k)
      whole = std::get<0>(values[k]) == p.planes_deg[k / angles] &&
              std::get<1>(values[k]) == p.angles_deg[k % angles];
    if (!whole) Fail(data, "its intensities do not fill a table of planes and angles");
    CompletePlanes(data, p);
    if (metric == "Radiant" || (emitter.child("RadiantData") && !emitter.child("LuminousData")))
      p.odd.push_back("its values are radiant, in W/sr, not cd");
    if (p.type == PhotometryType::kC) ClosePlanes(p);
    Validate(p, file_);
  }

  // Symm says what the range of planes says; of planes all around it only confirms them.
  void CompletePlanes(const XmlElement& data, Photometry& p) const {
    if (p.type != PhotometryType::kC) return;
    std::string symmetry = data.text_of("Symm");
    if (symmetry.empty()) symmetry = data.text_of("SymmType");
    std::erase_if(symmetry, [](char c) { return c == ' ' || c == '_'; });
    if (symmetry == "SymmFull" && p.planes_deg.size() > 1)
      p.odd.push_back("it says that all planes are alike, and gives several");
    CompletePlanesOfTypeC(p, file_);
  }

  const std::string& file_;
};

}  // namespace

Photometry ParseTm33(std::string_view text, const std::string& file) {
  const XmlElement root = ParseXml(text, file);
  if (!root.name.starts_with("IESTM33") && !root.name.starts_with("ATLA_S001") &&
      root.name != "LuminaireOpticalData")
    throw InputError(file,
                     fmt::format("its element <{}> is none of TM-33", core::Printable(root.name)),
                     "name a TM-33 file");
  return Reader(file).Read(root);
}

}  // namespace luxfield::formats
