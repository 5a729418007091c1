#include "luxfield/cli/reports/eye_report.h"

#include <fmt/format.h>

#include "luxfield/cli/reports/estimate_json.h"
#include "luxfield/cli/reports/estimate_table.h"
#include "luxfield/cli/reports/eye_picture.h"

namespace luxfield::cli {
namespace {

using core::Json;
using photometry::Estimate;
using photometry::EyeAnswer;

// What a person should know of the luminous area, a sentence; empty: nothing.
std::string AreaNote(const EyeAnswer& answer, const PhotometryNames& names) {
  if (names.LuminanceSuffix() != "cd_per_m2") return "";
  if (!answer.area)
    return fmt::format(
        "Nothing of the lamp is as bright as {:g} {} from there: there is no luminous area{}.",
        answer.asked.threshold, names.LuminanceUnit(), answer.asked.background ? " to rate" : "");
  if (answer.fields.empty() || !answer.fields[0].peak.u || answer.area->solid_angle.u) return "";
  return fmt::format(
      "The noise of a single ray is more than half of {:g} {}: in places darkness counts as "
      "bright, "
      "and how uncertain the luminous area is cannot be told. Ask for a higher threshold.",
      answer.asked.threshold, names.LuminanceUnit());
}

}  // namespace

std::vector<NumberRow> EyeRows(const EyeAnswer& answer, const PhotometryNames& names) {
  std::vector<NumberRow> rows;
  const std::string &where = answer.asked.name, luminance = names.LuminanceUnit();
  const auto add = [&](const std::string& quantity, const std::string& unit,
                       const std::optional<Estimate>& estimate) {
    if (estimate) rows.push_back({quantity, where, unit, *estimate});
  };
  for (const auto& field : answer.fields) {
    add(fmt::format("largest mean {} over {:g} mrad", names.Luminance(), field.mrad), luminance,
        field.largest);
    add(fmt::format("peak {} within these {:g} mrad", names.Luminance(), field.mrad), luminance,
        field.peak);
  }
  if (answer.area) {
    add(fmt::format("mean luminance of what is above {:g} {}", answer.asked.threshold, luminance),
        luminance, answer.area->luminance);
    add("solid angle of that", "sr", answer.area->solid_angle);
    add("projected area of that", "m²", answer.area->projected_m2);
  }
  const auto add_rating = [&](const std::string& quantity, const std::optional<Estimate>& rating) {
    if (rating) rows.push_back({quantity, where, "1", *rating, true});
  };
  add_rating("UGR of this lamp alone", answer.ugr);
  add_rating("UGR of the opening, evenly bright", answer.plain_ugr);
  add("veiling " + names.Luminance(), luminance, answer.veiling);
  add("threshold increment", "%", answer.threshold_increment);
  return rows;
}

void PrintEye(const EyeAnswer& answer, const PhotometryNames& names) {
  for (const NumberRow& row : EyeRows(answer, names))
    fmt::print("  {}: {} {}\n", row.where, row.quantity,
               row.rating && IsBelowScale(row.value)
                   ? BelowScaleText()
                   : EstimateText(row.value, row.unit == "1" ? "" : row.unit));
  if (const std::string note = AreaNote(answer, names); !note.empty())
    fmt::print("  {}: {}\n", answer.asked.name, note);
}

Json EyeJson(const EyeAnswer& answer, const PhotometryNames& names) {
  const std::string suffix = names.LuminanceSuffix();
  Json fields = Json::array();
  for (const auto& field : answer.fields) {
    Json one = {{"field_of_view_mrad", field.mrad},
                {"direction", VectorJson(field.direction)},
                {"peak_direction", VectorJson(field.peak_direction)}};
    PutEstimate(one, "luminance_largest_mean_" + suffix, field.largest);
    PutEstimate(one, "luminance_peak_" + suffix, field.peak);
    fields.push_back(one);
  }
  Json json = {{"name", answer.asked.name},
               {"eye_m", VectorJson(answer.asked.eye_m)},
               {"fields_of_view", fields}};
  const auto part = [&](Estimate photometry::LuminousArea::*which) {
    return answer.area ? std::optional((*answer.area).*which) : std::nullopt;
  };
  PutEstimate(json, "luminous_solid_angle_sr", part(&photometry::LuminousArea::solid_angle));
  PutEstimate(json, "luminous_area_m2", part(&photometry::LuminousArea::projected_m2));
  PutEstimate(json, "luminance_of_luminous_area_" + suffix,
              part(&photometry::LuminousArea::luminance));
  PutEstimate(json, "ugr", answer.ugr);
  PutEstimate(json, "ugr_plain", answer.plain_ugr);
  PutEstimate(json, "veiling_luminance_" + suffix, answer.veiling);
  PutEstimate(json, "threshold_increment_percent", answer.threshold_increment);
  return json;
}

void AddEyes(HtmlPage& page, const photometry::Lamp& lamp, const std::string& file,
             const std::vector<EyeAnswer>& eyes, const PhotometryNames& names) {
  if (eyes.empty()) return;
  page.Heading(names.LuminanceTitle());
  for (const EyeAnswer& answer : eyes) {
    EstimateRows rows{EstimateHead(answer.asked.name)};
    for (const NumberRow& row : EyeRows(answer, names))
      rows.push_back(row.rating ? RatingRow(row.quantity, row.value)
                                : EstimateRow(row.quantity, row.value, row.unit));
    const auto eye = PictureAsked(lamp, answer.asked);
    if (eye)
      AddBeside(page, {SvgEyePicture(lamp, answer, *eye, names)}, rows);
    else
      AddEstimates(page, rows);
    if (const std::string note = AreaNote(answer, names); !note.empty()) page.Paragraph(note);
    if (!eye) continue;
    if (const std::string note = EyePictureNote(answer, names); !note.empty()) page.Paragraph(note);
    page.Paragraph(ExportNoteOf(*eye, file));
  }
}

}  // namespace luxfield::cli
