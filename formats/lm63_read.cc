#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

constexpr double kFoot_m = 0.3048;
constexpr int kMostAngles = 100000;

struct Version {
  int year = 1986;
  bool named = false;  // by the first line
};

Version VersionOf(const std::string& first_line) {
  constexpr std::pair<std::string_view, int> kMarks[] = {
      {"IESNA86", 1986},          {"IESNA91", 1991},        {"IESNA:LM-63-1995", 1995},
      {"IESNA:LM-63-2002", 2002}, {"IES:LM-63-2019", 2019}, {"IESNA:LM-63-2019", 2019}};
  for (const auto& [mark, year] : kMarks)
    if (first_line == mark) return {year, true};
  return {};
}

// By version (docs/formats/photometric-files.md, "Opening"). Width lies along C90, length along C0.
Opening OpeningOf(double width, double length, double height, int year, Photometry& photometry) {
  using enum Opening::Shape;
  const double w = std::abs(width), l = std::abs(length), h = std::abs(height);
  const bool since_2002 = year >= 2002;
  if (width == 0 && length == 0 && height == 0) return {};
  if (width >= 0 && length >= 0 && height >= 0) return {kBox, l, w, h};
  if (width == 0 && length > 0) return {kCylinderAlongC0, l, h, h};
  if (width > 0 && length == 0) return {kCylinderAlongC90, h, w, h};
  if (width < 0 && length == 0) {
    if (height >= 0) return {kEllipse, w, w, h};
    if (h != w) return {kEllipsoid, w, w, h};
    if (since_2002) return {kVerticalDisc, 0, w, w};
    return {kEllipsoid, w, w, w};
  }
  if (since_2002 && height < 0 && width < 0 && length > 0 && h == w)
    return {kCylinderAlongC0, l, w, w};
  if (since_2002 && height < 0 && width > 0 && length < 0 && h == l)
    return {kCylinderAlongC90, l, w, l};
  if (width == 0) {
    photometry.odd.push_back("its opening has a round length and no width; a disc is taken");
    return {kEllipse, l, l, h};
  }
  if (width > 0 && length > 0) {
    photometry.odd.push_back("its opening has a negative height on a rectangle; a box is taken");
    return {kBox, l, w, h};
  }
  return {height < 0 ? kEllipsoid : kEllipse, l, w, h};
}

// Lines before TILT=: keywords, or free text of 1986.
void ReadKeywords(TextReader& reader, const std::string& first_line, bool has_version,
                  Photometry& p, std::string& tilt) {
  std::string line = has_version ? reader.Line("line TILT=") : first_line;
  while (true) {
    std::string upper = line.substr(0, 5);
    std::transform(upper.begin(), upper.end(), upper.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    if (upper == "TILT=") break;
    const auto close = line.find(']');
    if (line.starts_with('[') && close != std::string::npos) {
      const std::string key = line.substr(1, close - 1);
      const std::string text(Trimmed(std::string_view(line).substr(close + 1)));
      if (key == "MORE" && !p.keywords.empty())
        p.keywords.back().second += "\n" + text;
      else
        p.keywords.emplace_back(key, text);
    } else if (!line.empty()) {
      p.keywords.emplace_back("", line);
    }
    if (reader.AtEnd()) reader.Fail("the file ends without a line that begins with TILT=");
    line = reader.Line("line TILT=");
  }
  tilt = std::string(Trimmed(std::string_view(line).substr(5)));
}

void ReadTilt(TextReader& reader, const std::string& tilt, Photometry& p) {
  if (tilt == "NONE") return;
  if (tilt != "INCLUDE") {
    p.odd.push_back(fmt::format("its tilt factors are in another file, {}, and are not read",
                                core::Printable(tilt)));
    return;
  }
  Tilt read;
  read.lamp_geometry = reader.Count("lamp-to-luminaire geometry", 1, 3);
  const int count = reader.Count("number of tilt angles", 1, kMostAngles);
  for (int k = 0; k < count; ++k) read.angles_deg.push_back(reader.Number("tilt angles"));
  for (int k = 0; k < count; ++k) read.factors.push_back(reader.Number("tilt factors"));
  p.tilt = std::move(read);
}

void CompletePlanes(Photometry& p, const std::string& file) {
  if (p.type == PhotometryType::kC) {
    CompletePlanesOfTypeC(p, file);
    return;
  }
  if (p.planes_deg.front() != 0) return;
  // Half of what is symmetric to the vertical plane H = 0.
  const std::size_t given = p.planes_deg.size(), angles = p.angles_deg.size();
  std::vector<double> planes, values;
  for (std::size_t k = given; k-- > 1;) {
    planes.push_back(-p.planes_deg[k]);
    for (std::size_t j = 0; j < angles; ++j) values.push_back(p.at(k, j));
  }
  planes.insert(planes.end(), p.planes_deg.begin(), p.planes_deg.end());
  values.insert(values.end(), p.intensity_cd.begin(), p.intensity_cd.end());
  p.planes_deg = std::move(planes);
  p.intensity_cd = std::move(values);
}

PhotometryType TypeOf(int code) {
  return code == 1 ? PhotometryType::kC : code == 2 ? PhotometryType::kB : PhotometryType::kA;
}

// Its text says that values are no candelas, as of ultraviolet lamps.
void LookForUnits(Photometry& p) {
  for (const auto& [key, text] : p.keywords)
    if (text.find("mW/sr") != std::string::npos || text.find("W/sr") != std::string::npos) {
      p.odd.push_back("its text says that values are radiant, in W/sr or mW/sr, not cd");
      return;
    }
}

double Positive(TextReader& reader, const char* field) {
  const double value = reader.Number(field);
  if (!(value > 0)) reader.Fail(fmt::format("{} = {:g} must be above 0", field, value));
  return value;
}

}  // namespace

Photometry ParseLm63(std::string_view text, const std::string& file) {
  TextReader reader(text, file);
  Photometry p;
  const std::string first = reader.Line("first line");
  Version version = VersionOf(first);
  if (!version.named && first.starts_with("IES")) {
    version = {2002, true};
    p.odd.push_back(fmt::format("its first line, {}, is no version known; it is read as of 2002",
                                core::Printable(first)));
  }
  p.format = fmt::format("LM-63-{}", version.year);
  std::string tilt;
  ReadKeywords(reader, first, version.named, p, tilt);
  ReadTilt(reader, tilt, p);

  LampSet lamps;
  lamps.count = reader.Count("number of lamps", 0, 1000000);
  const double lumens = reader.Number("lumens per lamp");
  const double multiplier = Positive(reader, "candela multiplier");
  const int angles = reader.Count("number of vertical angles", 2, kMostAngles);
  const int planes = reader.Count("number of horizontal angles", 1, kMostAngles);
  p.type = TypeOf(reader.Count("photometric type", 1, 3));
  const double unit_m = reader.Count("units type", 1, 2) == 1 ? kFoot_m : 1;
  const double width = unit_m * reader.Number("width"), length = unit_m * reader.Number("length"),
               height = unit_m * reader.Number("height");
  for (const double size : {width, length, height})
    if (!(std::abs(size) <= 1e6)) reader.Fail(fmt::format("opening of {:g} m is none", size));
  p.opening = OpeningOf(width, length, height, version.year, p);
  double factor = multiplier * Positive(reader, "ballast factor");
  const double third = reader.Number("ballast-lamp factor, or what later versions have there");
  if (version.year <= 1991 && third > 0) factor *= third;
  if (version.year <= 1991 && !(third > 0))
    p.odd.push_back(fmt::format("its ballast-lamp factor is {:g}; 1 is taken", third));
  p.input_watts = reader.Number("input watts");

  // Every value takes a digit and a separator at least.
  if (static_cast<double>(angles) * planes > static_cast<double>(text.size()))
    reader.Fail(fmt::format("{} planes of {} angles do not fit a file of {} bytes", planes, angles,
                            text.size()));
  for (int k = 0; k < angles; ++k) p.angles_deg.push_back(reader.Number("vertical angles"));
  for (int k = 0; k < planes; ++k) p.planes_deg.push_back(reader.Number("horizontal angles"));
  for (std::size_t k = 0; k < static_cast<std::size_t>(angles) * planes; ++k)
    p.intensity_cd.push_back(factor * reader.Number("candela values"));
  if (reader.HasNumber()) p.odd.push_back("text follows its candela values and is not read");

  p.absolute = lumens < 0;
  if (p.absolute && lumens != -1)
    p.odd.push_back(
        fmt::format("lumens per lamp = {:g}, where -1 marks absolute photometry", lumens));
  if (!p.absolute) {
    lamps.flux_lm = lamps.count * lumens;
    p.lamp_flux_lm = lamps.flux_lm;
  }
  lamps.type = p.keyword("LAMP");
  lamps.watts = p.input_watts;
  p.lamps = {lamps};
  if (p.type == PhotometryType::kC)
    for (const double plane : p.planes_deg)
      if (!(plane >= 0 && plane <= 360))
        reader.Fail(fmt::format("horizontal angle {:g} lies outside 0 to 360", plane));
  for (std::size_t k = 1; k < p.planes_deg.size(); ++k)
    if (!(p.planes_deg[k] > p.planes_deg[k - 1]))
      reader.Fail(
          fmt::format("horizontal angle {:g} follows {:g}", p.planes_deg[k], p.planes_deg[k - 1]));
  CompletePlanes(p, file);
  if (p.type == PhotometryType::kC) ClosePlanes(p);
  LookForUnits(p);
  Validate(p, file);
  return p;
}

}  // namespace luxfield::formats
