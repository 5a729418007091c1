#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

constexpr int kMostAngles = 100000, kMostSets = 1000;
constexpr int kRatios = 10;

enum SymmetryCode { kNone, kVerticalAxis, kC0C180, kC90C270, kBothPlanes };

struct Head {
  SymmetryCode symmetry = kNone;
  int planes = 0, angles = 0;
  double plane_step = 0, angle_step = 0;

  int stored() const {
    switch (symmetry) {
      case kNone:
        return planes;
      case kVerticalAxis:
        return 1;
      case kC0C180:
      case kC90C270:
        return planes / 2 + 1;
      case kBothPlanes:
        return planes / 4 + 1;
    }
    return 0;
  }
  // In the list of all planes' angles.
  int first_stored() const { return symmetry == kC90C270 ? 3 * planes / 4 : 0; }
};

void AddText(Photometry& p, const char* key, const std::string& text) {
  if (!text.empty()) p.keywords.emplace_back(key, text);
}

double Millimetres(TextReader& reader, const char* field) {
  const double mm = reader.LineNumber(field, 0);
  if (!(mm >= 0 && mm <= 1e9)) reader.Fail(fmt::format("{} = {:g} mm is none", field, mm));
  return 1e-3 * mm;
}

// The luminaire and what of it shines: length along C90, width along C0; a width of 0 is round.
void ReadSizes(TextReader& reader, Photometry& p) {
  double length = Millimetres(reader, "length of the luminaire");
  double width = Millimetres(reader, "width of the luminaire");
  const double height = Millimetres(reader, "height of the luminaire");
  p.housing_m = {width > 0 ? width : length, length, height};
  length = Millimetres(reader, "length of the luminous area");
  width = Millimetres(reader, "width of the luminous area");
  double highest = 0, lowest = 1e300;
  for (const char* field : {"luminous height C0", "luminous height C90", "luminous height C180",
                            "luminous height C270"}) {
    const double side = Millimetres(reader, field);
    highest = std::max(highest, side);
    lowest = std::min(lowest, side);
  }
  if (highest != lowest)
    p.odd.push_back(fmt::format(
        "its luminous heights differ from side to side, {:g} to {:g} mm; the largest is taken",
        1e3 * lowest, 1e3 * highest));
  if (length == 0 && width == 0 && highest == 0) return;
  p.opening = width > 0 ? Opening{Opening::Shape::kBox, width, length, highest}
                        : Opening{Opening::Shape::kEllipse, length, length, highest};
}

LampSet ReadLampSet(TextReader& reader) {
  LampSet set;
  set.count = reader.LineCount("number of lamps", -1000000, 1000000);
  set.type = reader.Line("type of lamps");
  set.flux_lm = reader.LineNumber("flux of the lamps");
  if (!(set.flux_lm >= 0))
    reader.Fail(fmt::format("flux of the lamps = {:g} lm is negative", set.flux_lm));
  set.colour = reader.Line("colour of the lamps");
  set.colour_rendering = reader.Line("colour rendering of the lamps");
  set.watts = reader.LineNumber("watts of the lamps", 0);
  return set;
}

// Of the angles that the table stores, the whole turn.
void CompletePlanes(Photometry& p, const Head& head, const std::string& file) {
  switch (head.symmetry) {
    case kNone:
      break;
    case kVerticalAxis:
      p.planes_deg = {0};
      break;
    case kC0C180:
      MirrorPlanes(p, 0, file);
      break;
    case kC90C270:
      MirrorPlanes(p, 90, file);
      break;
    case kBothPlanes:
      MirrorPlanes(p, 90, file);
      MirrorPlanes(p, 0, file);
      break;
  }
  ClosePlanes(p);
}

void CheckSteps(Photometry& p, const Head& head, const std::vector<double>& planes) {
  const auto differs = [](const std::vector<double>& list, double step) {
    for (std::size_t k = 1; k < list.size() && step > 0; ++k)
      if (std::abs(list[k] - list[k - 1] - step) > 0.01) return true;
    return false;
  };
  if (differs(planes, head.plane_step))
    p.odd.push_back(fmt::format("its planes do not lie {:g} degrees apart, as the header says",
                                head.plane_step));
  if (differs(p.angles_deg, head.angle_step))
    p.odd.push_back(fmt::format(
        "its gamma angles do not lie {:g} degrees apart, as the header says", head.angle_step));
}

}  // namespace

Photometry ParseEulumdat(std::string_view text, const std::string& file) {
  TextReader reader(text, file);
  Photometry p;
  p.format = "EULUMDAT";
  AddText(p, "MANUFAC", reader.Line("company"));
  const int kind = reader.LineCount("type indicator", 0, 3);
  if (kind == 0) p.odd.push_back("its type indicator is 0, of 1 to 3");
  Head head;
  head.symmetry = static_cast<SymmetryCode>(reader.LineCount("symmetry indicator", 0, 4));
  head.planes = reader.LineCount("number of planes", 1, kMostAngles);
  head.plane_step = reader.LineNumber("distance of planes", 0);
  head.angles = reader.LineCount("number of gamma angles", 2, kMostAngles);
  head.angle_step = reader.LineNumber("distance of gamma angles", 0);
  if ((head.symmetry == kBothPlanes || head.symmetry == kC90C270) && head.planes % 4 != 0)
    reader.Fail(
        fmt::format("number of planes = {} does not have a quarter, which symmetry {} asks for",
                    head.planes, int(head.symmetry)));
  if (head.symmetry == kC0C180 && head.planes % 2 != 0)
    reader.Fail(fmt::format("number of planes = {} does not have a half, which symmetry 2 asks for",
                            head.planes));
  AddText(p, "TEST", reader.Line("report number"));
  AddText(p, "LUMINAIRE", reader.Line("name of the luminaire"));
  AddText(p, "LUMCAT", reader.Line("number of the luminaire"));
  AddText(p, "_FILE", reader.Line("name of the file"));
  AddText(p, "ISSUEDATE", reader.Line("date and user"));
  ReadSizes(reader, p);
  const double downward = reader.LineNumber("downward flux fraction", 0);
  const double output = reader.LineNumber("light output ratio", 100);
  double factor = reader.LineNumber("conversion factor", 1);
  if (!(factor > 0)) {
    p.odd.push_back(fmt::format("its conversion factor is {:g}; 1 is taken", factor));
    factor = 1;
  }
  const double tilt = reader.LineNumber("tilt", 0);
  if (tilt != 0) p.odd.push_back(fmt::format("it was measured tilted by {:g} degrees", tilt));
  const int sets = reader.LineCount("number of lamp sets", 1, kMostSets);
  for (int k = 0; k < sets; ++k) p.lamps.push_back(ReadLampSet(reader));
  for (int k = 0; k < kRatios; ++k) reader.LineNumber("direct ratios", 0);

  const int stored = head.stored();
  if (static_cast<double>(stored) * head.angles > static_cast<double>(text.size()))
    reader.Fail(fmt::format("{} planes of {} angles do not fit a file of {} bytes", stored,
                            head.angles, text.size()));
  std::vector<double> planes;
  for (int k = 0; k < head.planes; ++k) planes.push_back(reader.LineNumber("planes' angles"));
  for (int k = 0; k < head.angles; ++k) p.angles_deg.push_back(reader.LineNumber("gamma angles"));
  for (int k = 0; k < stored; ++k) {
    const double plane = planes[static_cast<std::size_t>((head.first_stored() + k) % head.planes)];
    if (!(plane >= 0 && plane <= 360))
      reader.Fail(fmt::format("plane C{:g} lies outside 0 to 360", plane));
    p.planes_deg.push_back(plane);
  }
  const LampSet& lamps = p.lamps.front();
  if (!(lamps.flux_lm > 0)) reader.Fail("flux of the first lamp set = 0 lm leaves no intensity");
  const double scale = factor * lamps.flux_lm / 1000;
  for (int k = 0; k < stored * head.angles; ++k)
    p.intensity_cd.push_back(scale * reader.LineNumber("intensities"));

  p.absolute = lamps.count < 0;
  if (!p.absolute) p.lamp_flux_lm = lamps.flux_lm;
  p.stated_flux_lm = lamps.flux_lm * output / 100;
  p.input_watts = lamps.watts;
  CheckSteps(p, head, planes);
  CompletePlanes(p, head, file);
  Validate(p, file);
  if (sets > 1)
    p.odd.push_back(fmt::format("it has {} lamp sets; the first scales the table", sets));
  if (downward < 0 || downward > 100)
    p.odd.push_back(fmt::format("its downward flux fraction is {:g} %", downward));
  return p;
}

}  // namespace luxfield::formats
