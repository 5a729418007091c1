// What `photometry` says of a headlamp against a regulation: on the terminal, as JSON, as lines of CSV
// and as a section of the page.
#pragma once

#include <string>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/reports/number_row.h"
#include "luxfield/core/json.h"
#include "luxfield/photometry/headlamp.h"

namespace luxfield::cli {

struct HeadlampReport {
  photometry::Headlamp headlamp;
  std::vector<double> screen, aiming_screen, road, view;  // illuminance of its planes, lx
};
HeadlampReport ReportOfHeadlamp(const photometry::Lamp& lamp,
                                const photometry::HeadlampAsked& asked);

std::string VerdictName(photometry::Verdict verdict);  // "pass", "fail", "not measured"
// "0.57° D", "0°": `positive` and `negative` are what stands behind angles of either sign.
std::string AngleText(double degrees, const char* positive, const char* negative);
std::string PlaceText(photometry::Place place);  // "3.43° L, 0.57° U"
// The place of a value; "all of it" of sums and fluxes.
std::string WhereText(const photometry::Finding& finding);

void PrintHeadlamp(const HeadlampReport& report);
core::Json HeadlampJson(const HeadlampReport& report);

std::vector<NumberRow> HeadlampRows(const HeadlampReport& report);

// The table of requirements, its head first; without columns for uncertainty where there is none.
std::vector<std::vector<std::string>> RequirementTable(const photometry::Headlamp& headlamp);
// Screen with all places that are asked about, aiming screen (if any), the road from above and as the
// driver sees it, as SVG.
std::vector<std::string> HeadlampMaps(const HeadlampReport& report);
constexpr const char* kHeadlampMapsNote =
    "Rings mark where values were taken, crosses those that fail; dashes are the planes H = 0 and "
    "V = 0, "
    "full lines what lines and zones are asked about, and the cut-off.";
// "pass, all limits met with probability 0.99", aim and remarks, a paragraph each.
std::vector<std::string> HeadlampParagraphs(const photometry::Headlamp& headlamp);

void AddHeadlamp(HtmlPage& page, const HeadlampReport& report);

}  // namespace luxfield::cli
