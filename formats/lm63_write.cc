#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/formats/lm63.h"

namespace luxfield::formats {
namespace {

constexpr std::size_t kLongestLine = 132, kLongestText = 240;

void AddNumbers(std::string& text, const std::vector<double>& numbers) {
  std::string line;
  for (const double number : numbers) {
    const std::string word = fmt::format("{:.6g}", number);
    if (!line.empty() && line.size() + 1 + word.size() > kLongestLine) {
      text += line + "\r\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  text += line + "\r\n";
}

// Keywords take printable ASCII.
std::string Ascii(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0) == 0x80) continue;  // the rest of a UTF-8 character
    out += c >= ' ' && c < 127 ? c : '?';
  }
  return out.substr(0, kLongestText);
}

void AddKeyword(std::string& text, const std::string& key, std::string_view value) {
  for (bool first = true;; first = false) {
    const auto end = value.find('\n');
    text += fmt::format("[{}] {}\r\n", first ? key : "MORE", Ascii(value.substr(0, end)));
    if (end == std::string_view::npos) return;
    value.remove_prefix(end + 1);
  }
}

struct Sizes {
  double width = 0, length = 0, height = 0;
};

// As OpeningOf of the reader, of 2002 and later.
Sizes SizesOf(const Opening& o) {
  using enum Opening::Shape;
  switch (o.shape) {
    case kPoint:
      return {};
    case kBox:
      return {o.c90_m, o.c0_m, o.height_m};
    case kEllipse:
      if (o.c0_m == 0 || o.c90_m == 0) return {};
      return {-o.c90_m, -o.c0_m, o.height_m};
    case kCylinderAlongC0:
      return {-o.height_m, o.c0_m, -o.height_m};
    case kCylinderAlongC90:
      return {o.c90_m, -o.height_m, -o.height_m};
    case kEllipsoid:
      return {-o.c90_m, -o.c0_m, -o.height_m};
    case kVerticalDisc:
      return {-o.c90_m, 0, -o.c90_m};
  }
  return {};
}

void RequireHeld(const Photometry& p, const std::string& file) {
  Validate(p, file);
  const bool c = p.type == PhotometryType::kC;
  const double from = p.angles_deg.front(), to = p.angles_deg.back();
  const bool good = c ? (from == 0 || from == 90) && (to == 90 || to == 180)
                      : (from == 0 || from == -90) && to == 90;
  if (!good)
    throw InputError(
        file,
        fmt::format("LM-63 does not hold vertical angles from {:g} to {:g} degrees", from, to),
        "sample it from 0 to 90 or 180 degrees");
}

}  // namespace

std::string FormatLm63(const Photometry& p, Lm63Version version, const std::string& file) {
  RequireHeld(p, file);
  const bool is_2019 = version == Lm63Version::k2019;
  std::string text = is_2019 ? "IES:LM-63-2019\r\n" : "IESNA:LM-63-2002\r\n";
  for (const char* key : {"TEST", "TESTLAB", "ISSUEDATE", "MANUFAC"})
    AddKeyword(text, key, p.keyword(key).empty() ? "not stated" : p.keyword(key));
  for (const auto& [key, value] : p.keywords) {
    const bool required =
        key == "TEST" || key == "TESTLAB" || key == "ISSUEDATE" || key == "MANUFAC";
    if (!required) AddKeyword(text, key.empty() ? "OTHER" : Ascii(key), value);
  }
  if (p.tilt) {
    text += fmt::format("TILT=INCLUDE\r\n{}\r\n{}\r\n", p.tilt->lamp_geometry,
                        p.tilt->angles_deg.size());
    AddNumbers(text, p.tilt->angles_deg);
    AddNumbers(text, p.tilt->factors);
  } else {
    text += "TILT=NONE\r\n";
  }

  std::vector<double> planes, values;
  const auto add = [&](double plane, std::size_t k) {
    planes.push_back(plane);
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j) values.push_back(p.at(k, j));
  };
  const bool c = p.type == PhotometryType::kC;
  const PlaneRange range = c ? StoredRange(p) : PlaneRange{-180, 180};
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    if (p.planes_deg[k] >= range.first - 1e-6 && p.planes_deg[k] <= range.last + 1e-6)
      add(p.planes_deg[k], k);
  if (c && range.last == 360) {
    if (planes.empty() || planes.front() != 0)
      throw InputError(file, "LM-63 asks for a plane C0, which the table has not",
                       "sample it anew");
    add(360, 0);
  }

  const int lamps = p.lamps.empty() ? 1 : std::max(1, p.lamps.front().count);
  const bool relative = !p.absolute && p.lamp_flux_lm && *p.lamp_flux_lm > 0;
  const Sizes sizes = SizesOf(p.opening);
  const int type = c ? 1 : p.type == PhotometryType::kB ? 2 : 3;
  AddNumbers(text, {double(relative ? lamps : 1), relative ? *p.lamp_flux_lm / lamps : -1, 1,
                    double(p.angles_deg.size()), double(planes.size()), double(type), 2,
                    sizes.width, sizes.length, sizes.height});
  // Codes of LM-63-2019 for how a file came about: 1.00001 undefined, 1.00010 computed.
  text += fmt::format("1 {} {:.6g}\r\n",
                      !is_2019                          ? "1"
                      : p.keyword("_SIMULATED").empty() ? "1.00001"
                                                        : "1.00010",
                      p.input_watts);
  AddNumbers(text, p.angles_deg);
  AddNumbers(text, planes);
  for (std::size_t k = 0; k < planes.size(); ++k)
    AddNumbers(text, {values.begin() + std::ptrdiff_t(k * p.angles_deg.size()),
                      values.begin() + std::ptrdiff_t((k + 1) * p.angles_deg.size())});
  return text;
}

}  // namespace luxfield::formats
