// What `photometry` says of a lamp's luminance as eyes see it: on the terminal, as JSON, as lines of CSV
// and as a section of the page.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/number_row.h"
#include "luxfield/cli/reports/photometry_names.h"
#include "luxfield/core/json.h"
#include "luxfield/photometry/answers.h"

namespace luxfield::cli {

void PrintEye(const photometry::EyeAnswer& answer, const PhotometryNames& names);
core::Json EyeJson(const photometry::EyeAnswer& answer, const PhotometryNames& names);
std::vector<NumberRow> EyeRows(const photometry::EyeAnswer& answer, const PhotometryNames& names);

// `lamp` is what pictures are drawn from, `file` its light field.
void AddEyes(HtmlPage& page, const photometry::Lamp& lamp, const std::string& file,
             const std::vector<photometry::EyeAnswer>& eyes, const PhotometryNames& names);

}  // namespace luxfield::cli
