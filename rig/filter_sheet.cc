#include "luxfield/rig/filter_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/config.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"

namespace luxfield::rig {
namespace {

using core::Field;
using core::Json;

constexpr int kVersion = 1, kWedgeSteps = 21;
constexpr double kWedgeDensityStep = 0.15;

bool Inside(const RegistrationMark& disc, lightfield::Vec2 p) {
  const lightfield::Vec2 d = p - disc.centre_m;
  return d.x * d.x + d.y * d.y <= disc.radius_m * disc.radius_m;
}

Json ToJson(const std::vector<RegistrationMark>& discs) {
  Json json = Json::array();
  for (const RegistrationMark& disc : discs)
    json.push_back(
        {{"x_m", disc.centre_m.x}, {"y_m", disc.centre_m.y}, {"radius_m", disc.radius_m}});
  return json;
}

std::vector<RegistrationMark> DiscsFromJson(const Json& json, const std::string& key,
                                            const std::string& file) {
  std::vector<RegistrationMark> discs;
  for (const Json& disc : Field<Json>(json, key, file)) {
    discs.push_back({{Field<double>(disc, "x_m", file), Field<double>(disc, "y_m", file)},
                     Field<double>(disc, "radius_m", file)});
    if (!(discs.back().radius_m > 0))
      throw InputError(file, fmt::format("{}: a radius_m is not above 0", key),
                       "correct the holder's or the sheet's marks");
  }
  return discs;
}

Json ToJson(const FilterSheet& sheet) {
  Json wedge = Json::array();
  for (const WedgeStep& step : sheet.wedge)
    wedge.push_back({{"x0_m", step.low_m.x},
                     {"y0_m", step.low_m.y},
                     {"x1_m", step.high_m.x},
                     {"y1_m", step.high_m.y},
                     {"code", step.code}});
  return {{"format", kFilterSheetFormat},
          {"version", kVersion},
          {"filter", sheet.filter == lightfield::FilterKind::kDual ? "dual" : "basis"},
          {"basis", sheet.basis.name()},
          {"basis_a", sheet.basis.a},
          {"spacing_m", sheet.spacing_m},
          {"filter_scale", sheet.filter_scale},
          {"half_m", sheet.half_m},
          {"marks", ToJson(sheet.marks)},
          {"wedge", wedge},
          {"holder_marks", ToJson(sheet.holder_marks)}};
}

}  // namespace

double ToneTable::Code(double transmittance) const {
  if (!(transmittance > 0)) return 0;
  if (code.empty()) return transmittance;
  const double target = clear_density() - std::log10(transmittance);
  const auto above = std::lower_bound(density.begin() + 1, density.end() - 1, target);
  const auto k = static_cast<std::size_t>(above - density.begin());
  const double x0 = -std::log10(code[k - 1]), x1 = -std::log10(code[k]);
  const double share = (target - density[k - 1]) / (density[k] - density[k - 1]);
  return std::min(1.0, std::pow(10, -(x0 + share * (x1 - x0))));
}

ToneTable ReadToneTable(const std::filesystem::path& path) {
  const core::Config config = core::Config::FromFile(path);
  const core::Config tone = config.Table("tone");
  ToneTable table{tone.Numbers("code", 0), tone.Numbers("density", 0)};
  config.Finish();
  if (table.code.size() < 2 || table.code.size() != table.density.size())
    tone.Fail("density", "must have as many entries as code, and at least 2");
  if (std::abs(table.code[0] - 1) > 1e-12) tone.Fail("code", "must start at 1, clear film");
  for (std::size_t k = 0; k < table.code.size(); ++k)
    if (!(table.code[k] > 0 && (k == 0 || table.code[k] < table.code[k - 1])))
      tone.Fail("code", "must fall strictly and stay above 0");
  for (std::size_t k = 1; k < table.density.size(); ++k)
    if (!(table.density[k] > table.density[k - 1]))
      tone.Fail("density", "must rise strictly", "leave out the steps that the film cannot tell");
  return table;
}

void WriteToneTable(const std::filesystem::path& path, const ToneTable& table) {
  std::string text = "[tone]\n";
  for (const auto& [name, values] :
       {std::pair{"code", &table.code}, std::pair{"density", &table.density}})
    text += fmt::format("{} = [{}]\n", name, fmt::join(*values, ", "));
  core::WriteFileAtomically(path, text);
}

FilterSheet FilterSheet::Make(lightfield::FilterKind filter, const lightfield::Basis& basis,
                              double spacing_m, double filter_scale) {
  FilterSheet sheet;
  sheet.filter = filter;
  sheet.basis = basis;
  sheet.spacing_m = spacing_m;
  sheet.filter_scale = filter_scale;
  if (!(spacing_m > 0 && std::isfinite(spacing_m)))
    throw InputError(fmt::format("filter spacing {} m must be above 0", spacing_m));
  if (filter == lightfield::FilterKind::kDual) sheet.peaks_ = basis.DualPeaks();
  const double most = filter == lightfield::FilterKind::kDual ? 1 : 1 / std::pow(basis.Peak(), 2);
  if (!(filter_scale > 0 && filter_scale <= most * (1 + 1e-12)))
    throw InputError(fmt::format(
        "filter scale {} is outside (0, {:.6g}]: a print lets through at most all light",
        filter_scale, most));

  const double s = basis.cells * spacing_m, radius = s / 50;
  sheet.half_m = 0.7 * s;
  for (const double y : {0.58, -0.58})
    for (const double x : {-0.58, 0.58}) sheet.marks.push_back({{x * s, y * s}, radius});
  sheet.marks.push_back({{-0.48 * s, 0.58 * s}, radius});
  for (int k = 0; k < kWedgeSteps; ++k) {
    const double width = 0.96 * s / kWedgeSteps, x = -0.48 * s + k * width;
    sheet.wedge.push_back(
        {{x, -0.64 * s}, {x + width, -0.54 * s}, std::pow(10, -kWedgeDensityStep * k)});
  }
  for (const double y : {0.8, 0.0, -0.8})
    for (const double x : {-0.8, 0.0, 0.8})
      if (x != 0 || y != 0) sheet.holder_marks.push_back({{x * s, y * s}, radius});
  return sheet;
}

double FilterSheet::FilterTransmittance(lightfield::Vec2 offset, int print) const {
  const double x = offset.x / spacing_m, y = offset.y / spacing_m;
  if (filter == lightfield::FilterKind::kDual) {
    const double value = basis.DualValue(x) * basis.DualValue(y);
    return peaks_[print] > 0 ? std::max(print == 0 ? value : -value, 0.0) / peaks_[print] : 0;
  }
  const double centre = 0.5 * basis.cells;
  return filter_scale * basis.Value(x + centre) * basis.Value(y + centre);
}

const WedgeStep* FilterSheet::StepAt(lightfield::Vec2 offset) const {
  for (const WedgeStep& step : wedge)
    if (offset.x >= step.low_m.x && offset.x < step.high_m.x && offset.y >= step.low_m.y &&
        offset.y < step.high_m.y)
      return &step;
  return nullptr;
}

double FilterSheet::Transmittance(lightfield::Vec2 offset, int print) const {
  const double support = 0.5 * basis.cells * spacing_m;
  if (std::abs(offset.x) <= support && std::abs(offset.y) <= support)
    return FilterTransmittance(offset, print);
  if (const WedgeStep* step = StepAt(offset)) return step->code;
  return std::any_of(marks.begin(), marks.end(),
                     [&](const RegistrationMark& d) { return Inside(d, offset); })
             ? 1
             : 0;
}

std::string SheetText(const FilterSheet& sheet) { return ToJson(sheet).dump(); }

void WriteFilterSheet(const std::filesystem::path& path, const FilterSheet& sheet) {
  core::WriteJson(path, ToJson(sheet));
}

FilterSheet ReadFilterSheet(const std::filesystem::path& path) {
  return ParseFilterSheet(core::ReadFile(path), path.string());
}

FilterSheet ParseFilterSheet(const std::string& text, const std::string& file) {
  const Json json = core::ParseJson(text, file);
  if (const auto format = Field<std::string>(json, "format", file); format != kFilterSheetFormat)
    throw InputError(file, fmt::format("format = '{}' is not '{}'", format, kFilterSheetFormat),
                     "give the .sheet.json that `luxfield filter print` wrote");
  if (const int version = Field<int>(json, "version", file); version != kVersion)
    throw InputError(file, fmt::format("version = {} where {} is understood", version, kVersion),
                     "read it with the luxfield that wrote it");
  const auto kind = Field<std::string>(json, "filter", file);
  if (kind != "basis" && kind != "dual")
    throw InputError(file, fmt::format("filter = '{}' is neither basis nor dual", kind),
                     "print the filter again");
  FilterSheet sheet = FilterSheet::Make(
      kind == "dual" ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis,
      lightfield::Basis::FromName(Field<std::string>(json, "basis", file),
                                  Field<double>(json, "basis_a", file)),
      Field<double>(json, "spacing_m", file), Field<double>(json, "filter_scale", file));
  sheet.half_m = Field<double>(json, "half_m", file);
  sheet.marks = DiscsFromJson(json, "marks", file);
  sheet.holder_marks = DiscsFromJson(json, "holder_marks", file);
  if (!(sheet.half_m > 0) || sheet.marks.size() < 3 || sheet.holder_marks.size() < 5)
    throw InputError(file, "needs a half_m above 0, 3 marks and 5 holder_marks at least",
                     "print the filter again, or add the holder's marks");
  sheet.wedge.clear();
  for (const Json& step : Field<Json>(json, "wedge", file))
    sheet.wedge.push_back({{Field<double>(step, "x0_m", file), Field<double>(step, "y0_m", file)},
                           {Field<double>(step, "x1_m", file), Field<double>(step, "y1_m", file)},
                           Field<double>(step, "code", file)});
  return sheet;
}

}  // namespace luxfield::rig
