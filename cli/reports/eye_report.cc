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

}  // namespace

std::vector<NumberRow> EyeRows(const EyeAnswer& answer, const PhotometryNames& names) {
  std::vector<NumberRow> rows;
  const std::string &where = answer.asked.name, luminance = names.LuminanceUnit();
  const auto add = [&](const std::string& quantity, const std::string& unit,
                       const std::optional<Estimate>& estimate) {
    if (estimate) rows.push_back({quantity, where, unit, *estimate});
  };
  for (const auto& field : answer.fields) {
    add(fmt::format("largest mean luminance over {:g} mrad", field.mrad), luminance, field.largest);
    add(fmt::format("peak luminance within these {:g} mrad", field.mrad), luminance, field.peak);
  }
  if (answer.area) {
    add(fmt::format("mean luminance of what is above {:g}", answer.asked.threshold), luminance,
        answer.area->luminance);
    add("solid angle of that", "sr", Estimate{answer.area->solid_angle, {}});
  }
  add("UGR of this lamp alone", "1", answer.ugr);
  add("UGR of the opening, evenly bright", "1", answer.plain_ugr);
  add("veiling luminance", luminance, answer.veiling);
  add("threshold increment", "%", answer.threshold_increment);
  return rows;
}

void PrintEye(const EyeAnswer& answer, const PhotometryNames& names) {
  for (const NumberRow& row : EyeRows(answer, names))
    fmt::print("  {}: {} {}\n", row.where, row.quantity,
               EstimateText(row.value, row.unit == "1" ? "" : row.unit));
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
               {"fields_of_view", fields},
               {"luminous_solid_angle_sr", answer.area ? Json(answer.area->solid_angle) : Json()}};
  PutEstimate(json, "luminance_of_luminous_area_" + suffix,
              answer.area ? std::optional(answer.area->luminance) : std::nullopt);
  PutEstimate(json, "ugr", answer.ugr);
  PutEstimate(json, "ugr_plain", answer.plain_ugr);
  PutEstimate(json, "veiling_luminance_" + suffix, answer.veiling);
  PutEstimate(json, "threshold_increment_percent", answer.threshold_increment);
  return json;
}

void AddEyes(HtmlPage& page, const photometry::Lamp& lamp, const std::string& file,
             const std::vector<EyeAnswer>& eyes, const PhotometryNames& names) {
  if (eyes.empty()) return;
  page.Heading("Luminance");
  for (const EyeAnswer& answer : eyes) {
    EstimateRows rows{EstimateHead(answer.asked.name)};
    for (const NumberRow& row : EyeRows(answer, names))
      rows.push_back(EstimateRow(row.quantity, row.value, row.unit == "1" ? "" : row.unit));
    const auto eye = PictureAsked(lamp, answer.asked);
    if (!eye) {
      AddEstimates(page, rows);
      continue;
    }
    AddBeside(page, {SvgEyePicture(lamp, answer, *eye, names)}, rows);
    if (const std::string note = EyePictureNote(answer); !note.empty()) page.Paragraph(note);
    page.Paragraph(ExportNoteOf(*eye, file));
  }
}

}  // namespace luxfield::cli
