#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/formats/eulumdat.h"

namespace luxfield::formats {
namespace {

// Characters beyond ISO-8859-1 and controls become '?'.
std::string Latin1(std::string_view utf8, std::size_t most) {
  std::string out;
  for (std::size_t k = 0; k < utf8.size() && out.size() < most; ++k) {
    const auto c = static_cast<unsigned char>(utf8[k]);
    if ((c & 0xC0) == 0x80) continue;
    const bool two = (c == 0xC2 || c == 0xC3) && k + 1 < utf8.size();
    const auto code = two ? ((c & 3u) << 6) | (static_cast<unsigned char>(utf8[k + 1]) & 0x3Fu) : c;
    const bool held = two ? code >= 0xA0 : c >= ' ' && c < 127;
    out += held ? static_cast<char>(code) : '?';
  }
  return out;
}

// The step of a list that has one, else 0.
double EvenStep(const std::vector<double>& list) {
  if (list.size() < 2) return 0;
  const double step = list[1] - list[0];
  for (std::size_t k = 1; k < list.size(); ++k)
    if (std::abs(list[k] - list[k - 1] - step) > 1e-6) return 0;
  return step;
}

// Share of flux that goes down, in percent.
double DownwardPercent(const Photometry& p, double flux) {
  Photometry down = p;
  std::vector<double> angles, values;
  for (const double gamma : p.angles_deg)
    if (gamma < 90) angles.push_back(gamma);
  angles.push_back(90);
  if (angles.size() < 2) return 0;
  return 100 * Flux(ResampledToTypeC(down, p.planes_deg, angles)) / flux;
}

struct Stored {
  int symmetry = 0;
  std::vector<std::size_t> planes;  // in the file's order
};

Stored StoredOf(const Photometry& p) {
  const auto& planes = p.planes_deg;
  const std::size_t count = planes.size();
  // Symmetries are written for planes that begin at C0 and have all four quarters' edges.
  const auto has = [&](double plane) {
    return std::any_of(planes.begin(), planes.end(),
                       [&](double c) { return std::abs(c - plane) < 1e-6; });
  };
  const Symmetry s = FindSymmetry(p);
  Stored stored;
  const auto take = [&](std::size_t first, std::size_t number) {
    for (std::size_t k = 0; k < number; ++k) stored.planes.push_back((first + k) % count);
  };
  if (s.rotational) {
    stored.symmetry = 1;
    take(0, 1);
  } else if (s.about_c0 && s.about_c90 && count % 4 == 0 && has(0) && has(90)) {
    stored.symmetry = 4;
    take(0, count / 4 + 1);
  } else if (s.about_c0 && count % 2 == 0 && has(0) && has(180)) {
    stored.symmetry = 2;
    take(0, count / 2 + 1);
  } else if (s.about_c90 && count % 4 == 0 && has(90) &&
             std::abs(planes[3 * count / 4] - 270) < 1e-6) {
    stored.symmetry = 3;
    take(3 * count / 4, count / 2 + 1);
  } else {
    take(0, count);
  }
  return stored;
}

}  // namespace

std::string FormatEulumdat(const Photometry& p, const std::string& file) {
  Validate(p, file);
  if (p.type != PhotometryType::kC)
    throw InputError(file, "EULUMDAT holds planes C alone, not types A and B",
                     "resample the table");
  const double flux = Flux(p);
  const bool relative = !p.absolute && p.lamp_flux_lm && *p.lamp_flux_lm > 0;
  const double per = relative ? *p.lamp_flux_lm : flux;
  if (!(per > 0))
    throw InputError(file, "has no flux, which EULUMDAT's intensities are given by",
                     "export another format");
  std::string text;
  const auto line = [&](const std::string& value) { text += value + "\r\n"; };
  const auto number = [&](double value) { line(fmt::format("{:.7g}", value)); };
  const auto key = [&](const char* name, std::size_t most) { line(Latin1(p.keyword(name), most)); };
  const Stored stored = StoredOf(p);
  const bool one = stored.symmetry == 1;
  key("MANUFAC", 78);
  line(one ? "1" : p.opening.c90_m > 3 * p.opening.c0_m ? "2" : "3");
  number(stored.symmetry);
  number(one ? 1 : double(p.planes_deg.size()));
  // An even step has to lead on from the last plane to C360.
  const double step = EvenStep(p.planes_deg);
  number(!one && std::abs(step * double(p.planes_deg.size()) - 360) < 1e-6 ? step : 0);
  number(double(p.angles_deg.size()));
  number(EvenStep(p.angles_deg));
  key("TEST", 78);
  key("LUMINAIRE", 78);
  key("LUMCAT", 78);
  key("_FILE", 8);
  key("ISSUEDATE", 78);
  const auto mm = [&](double metres) { number(1e3 * metres); };
  const bool round =
      p.opening.shape == Opening::Shape::kEllipse && p.opening.c0_m == p.opening.c90_m;
  const bool housing = p.housing_m[1] > 0;
  mm(housing ? p.housing_m[1] : p.opening.c90_m);
  mm(housing ? p.housing_m[0] : round ? 0 : p.opening.c0_m);
  mm(housing ? p.housing_m[2] : p.opening.height_m);
  mm(p.opening.c90_m);
  mm(round ? 0 : p.opening.c0_m);
  for (int side = 0; side < 4; ++side) mm(p.opening.height_m);
  number(flux > 0 ? DownwardPercent(p, flux) : 0);
  number(relative ? 100 * p.stated_flux_lm.value_or(flux) / per : 100);
  number(1);
  number(0);
  line("1");
  LampSet lamps = p.lamps.empty() ? LampSet{} : p.lamps.front();
  const int count = std::max(1, std::abs(lamps.count));
  number(relative ? count : -count);
  line(Latin1(lamps.type, 24));
  number(per);
  line(Latin1(lamps.colour, 16));
  line(Latin1(lamps.colour_rendering, 6));
  number(lamps.watts > 0 ? lamps.watts : p.input_watts);
  // Direct ratios k = 0.6 to 5, which an older method of planning interiors uses: not computed.
  for (int k = 0; k < 10; ++k) line("0");
  for (std::size_t k = 0; k < (one ? 1 : p.planes_deg.size()); ++k) number(p.planes_deg[k]);
  for (const double gamma : p.angles_deg) number(gamma);
  for (const std::size_t plane : stored.planes)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j) number(1000 * p.at(plane, j) / per);
  return text;
}

}  // namespace luxfield::formats
