#include "luxfield/photometry/regulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace luxfield::photometry {
namespace {

using core::Config;

constexpr core::Range kPositive = {0, 1e12};

Place PlaceOf(const Config& table, const char* key, double h, double v) {
  if (!(h >= -180 && h <= 180 && v >= -90 && v <= 90))
    table.Fail(key, fmt::format("holds H = {}, V = {}", h, v),
               "give degrees, H from -180 to 180 and V from -90 to 90");
  return {h, v};
}

Place ReadPlace(const Config& table, const char* key) {
  const auto pair = table.Numbers(key, 2);
  return PlaceOf(table, key, pair[0], pair[1]);
}

// [H, V, H, V, ...].
std::vector<Place> ReadPlaces(const Config& table, const char* key, std::size_t least) {
  const auto numbers = table.Numbers(key, 0);
  if (numbers.size() % 2 != 0 || numbers.size() < 2 * least)
    table.Fail(key, fmt::format("holds {} numbers", numbers.size()),
               fmt::format("give H and V in turn, of {} places or more", least));
  std::vector<Place> places;
  for (std::size_t k = 0; k < numbers.size(); k += 2)
    places.push_back(PlaceOf(table, key, numbers[k], numbers[k + 1]));
  return places;
}

std::optional<Limit> ReadLimit(const Config& table, const std::string& which,
                               const std::string& unit) {
  const std::string value = which + "_" + unit, share = which + "_share", of = which + "_share_of";
  Limit limit;
  if (table.Has(value)) {
    if (table.Has(share)) table.Fail(share, "is given beside " + value, "drop one of them");
    limit.value = table.Number(value, kPositive);
    return limit;
  }
  if (!table.Has(share)) return {};
  limit.share = table.Number(share, kPositive);
  limit.of = table.Text(of);
  return limit;
}

Requirement ReadRequirement(const Config& table, Requirement::Kind kind) {
  using Kind = Requirement::Kind;
  Requirement requirement;
  requirement.kind = kind;
  requirement.name = table.Text("name");
  switch (kind) {
    case Kind::kPoint:
      requirement.places = {ReadPlace(table, "at_deg")};
      break;
    case Kind::kLine:
    case Kind::kFlux:
      requirement.places = {ReadPlace(table, "from_deg"), ReadPlace(table, "to_deg")};
      break;
    case Kind::kZone:
      requirement.places = ReadPlaces(table, "corners_deg", 3);
      break;
    case Kind::kSum:
      requirement.places = ReadPlaces(table, "at_deg", 1);
      break;
    case Kind::kPeak:
      break;
  }
  const std::string unit = kind == Kind::kFlux ? "lm" : "cd";
  requirement.least = ReadLimit(table, "min", unit);
  requirement.most = ReadLimit(table, "max", unit);
  if (!requirement.least && !requirement.most)
    table.Fail("name", "has no limit",
               fmt::format("give min_{0}, max_{0}, min_share or max_share", unit));
  requirement.unless = table.Text("unless", "");
  return requirement;
}

// One place's scan is vertical or horizontal, of some length.
CutOffScan ReadScan(const Config& table) {
  const CutOffScan scan{ReadPlace(table, "from_deg"), ReadPlace(table, "to_deg")};
  const double h = scan.to.h_deg - scan.from.h_deg, v = scan.to.v_deg - scan.from.v_deg;
  if ((h != 0) == (v != 0))
    table.Fail("to_deg", "is neither above, below nor beside from_deg",
               "give a vertical or a horizontal scan");
  return scan;
}

Aiming ReadAiming(const Config& table) {
  Aiming aiming;
  const std::string by = table.Choice("by", {"none", "peak", "cut-off"});
  aiming.tolerance_h_deg = table.Number("tolerance_h_deg", 0, {0, 10});
  aiming.tolerance_v_deg = table.Number("tolerance_v_deg", 0, {0, 10});
  if (by == "none") return aiming;
  aiming.kind = by == "peak" ? Aiming::Kind::kPeak : Aiming::Kind::kCutOff;
  if (by == "peak") return aiming;
  const Config level = table.Table("level");
  aiming.level = ReadScan(level);
  if (aiming.level.from.h_deg != aiming.level.to.h_deg)
    level.Fail("to_deg", "is not above or below from_deg", "give a vertical scan");
  aiming.level_v_deg = level.Number("v_deg", {-20, 20});
  for (const Config& scan : table.Tables("sideways")) {
    aiming.sideways.push_back(ReadScan(scan));
    const bool horizontal = aiming.sideways.back().from.v_deg == aiming.sideways.back().to.v_deg;
    if (horizontal && aiming.sideways.size() > 1)
      scan.Fail("to_deg", "makes a second scan of a horizontal one",
                "give one horizontal scan or several vertical ones");
  }
  if (aiming.sideways.size() == 1 && aiming.sideways[0].from.h_deg == aiming.sideways[0].to.h_deg)
    table.Fail("sideways", "holds one vertical scan, through which no line is known",
               "give two of them, or a horizontal one");
  if (!aiming.sideways.empty()) {
    aiming.sideways_h_deg = table.Number("sideways_h_deg", {-20, 20});
    aiming.sideways_gradient = table.Number("sideways_gradient", 0, {0, 10});
  }
  return aiming;
}

CutOffLimits ReadCutOffLimits(const Config& table) {
  CutOffLimits limits;
  limits.receiver_side_m = table.Number("receiver_side_m", {1e-6, 10});
  if (table.Has("min_gradient")) limits.least_gradient = table.Number("min_gradient", {0, 10});
  if (table.Has("max_gradient")) limits.most_gradient = table.Number("max_gradient", {0, 10});
  limits.straight_h_deg = table.Numbers("straight_h_deg", 0, {});
  if (!limits.straight_h_deg.empty())
    limits.straight_within_deg = table.Number("straight_within_deg", {0, 10});
  return limits;
}

void CheckShares(const Config& config, const std::vector<Requirement>& requirements) {
  using Kind = Requirement::Kind;
  std::set<std::string> names, single;  // `single` have one value, which others may be a share of
  for (const Requirement& one : requirements) {
    if (!names.insert(one.name).second)
      config.Fail("name", fmt::format("= '{}' is that of two requirements", one.name),
                  "name them apart");
    if (one.kind == Kind::kPoint || one.kind == Kind::kSum || one.kind == Kind::kPeak)
      single.insert(one.name);
  }
  for (const Requirement& one : requirements)
    for (const auto* limit : {&one.least, &one.most})
      if (*limit && !(*limit)->value &&
          (!single.contains((*limit)->of) || (*limit)->of == one.name))
        config.Fail(
            "min_share_of or max_share_of",
            fmt::format("of '{}' = '{}' names no other point, sum or peak", one.name, (*limit)->of),
            "name one of this file");
}

Place MirroredPlace(Place place) { return {-place.h_deg, place.v_deg}; }

CutOffScan MirroredScan(const CutOffScan& scan) {
  return {MirroredPlace(scan.from), MirroredPlace(scan.to)};
}

// R and L at the end of words, also doubled and before digits, change places: 75R, B50L, H-3L, 25L1.
std::string MirroredName(std::string name) {
  const auto is_part_of_word = [&](std::size_t k) {
    return k < name.size() && std::isalpha(static_cast<unsigned char>(name[k]));
  };
  for (std::size_t k = 0; k < name.size(); ++k) {
    if (name[k] != 'R' && name[k] != 'L') continue;
    std::size_t first = k, last = k;
    while (first > 0 && (name[first - 1] == name[k])) --first;
    while (last + 1 < name.size() && name[last + 1] == name[k]) ++last;
    const bool alone = !is_part_of_word(last + 1) &&
                       (first == 0 || !std::islower(static_cast<unsigned char>(name[first - 1])));
    if (alone)
      for (std::size_t at = first; at <= last; ++at) name[at] = name[at] == 'R' ? 'L' : 'R';
    k = last;
  }
  return name;
}

}  // namespace

Regulation ReadRegulation(const std::filesystem::path& path) {
  using Kind = Requirement::Kind;
  const Config config = Config::FromFile(path);
  Regulation regulation;
  regulation.name = config.Text("name");
  regulation.source = config.Text("source");
  const Config receiver = config.Table("receiver");
  regulation.distance_m = receiver.Number("distance_m", {0.1, 1e4});
  regulation.receiver_side_m = receiver.Number("side_m", {1e-6, 10});
  regulation.aiming = ReadAiming(config.Table("aim"));
  if (const auto cut_off = config.OptionalTable("cut_off")) {
    if (regulation.aiming.kind != Aiming::Kind::kCutOff)
      config.Fail("cut_off", "asks for the cut-off of a lamp that is not aimed by one",
                  "aim.by = \"cut-off\" says where it is looked for");
    regulation.cut_off = ReadCutOffLimits(*cut_off);
  }
  if (const auto screen = config.OptionalTable("aiming_screen"))
    regulation.screen_m = screen->Number("distance_m", {0.1, 1e4});
  for (const auto& [key, kind] : {std::pair{"point", Kind::kPoint},
                                  {"line", Kind::kLine},
                                  {"zone", Kind::kZone},
                                  {"sum", Kind::kSum},
                                  {"peak", Kind::kPeak},
                                  {"flux", Kind::kFlux}})
    for (const Config& table : config.Tables(key))
      regulation.requirements.push_back(ReadRequirement(table, kind));
  if (regulation.requirements.empty())
    config.Fail("point", "is missing, and nothing else is asked for either",
                "give [[point]], [[line]], [[zone]], [[sum]], [[peak]] or [[flux]]");
  CheckShares(config, regulation.requirements);
  config.Finish();
  return regulation;
}

Regulation Mirrored(const Regulation& regulation) {
  Regulation mirrored = regulation;
  Aiming& aiming = mirrored.aiming;
  aiming.level = MirroredScan(aiming.level);
  for (CutOffScan& scan : aiming.sideways) scan = MirroredScan(scan);
  aiming.sideways_h_deg *= -1;
  if (mirrored.cut_off)
    for (double& h : mirrored.cut_off->straight_h_deg) h *= -1;
  for (Requirement& one : mirrored.requirements) {
    one.name = MirroredName(one.name);
    for (Place& place : one.places) place = MirroredPlace(place);
    for (auto* limit : {&one.least, &one.most})
      if (*limit) (*limit)->of = MirroredName((*limit)->of);
  }
  return mirrored;
}

}  // namespace luxfield::photometry
