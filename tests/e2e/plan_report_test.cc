// The table and the page of `luxfield plan --max-error`, from plans made up here.
#include "luxfield/cli/reports/plan_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>

#include "tests/e2e/program.h"

namespace luxfield::cli {
namespace {

using testing::HasSubstr;

planning::PlannedCapture Planned(const std::string& family, double capture_s, double error) {
  planning::PlannedCapture plan;
  plan.family = family;
  plan.capture_s = capture_s;
  plan.truncation = 0.6 * error;
  plan.noise = 0.8 * error;
  plan.plan.geometry.grid.spacing_m = 0.01;
  return plan;
}

// Two families of plans of 6 to 30 s, of which the fastest within 2 % is recommended.
planning::PlanForTarget Answer() {
  planning::PlanForTarget answer;
  answer.plans = {Planned("bspline2", 12, 0.03), Planned("bspline2", 30, 0.01),
                  Planned("bilinear", 6, 0.05), Planned("bilinear", 24, 0.015)};
  answer.recommended = answer.plans[3];
  return answer;
}

const PlanQuestion kQuestion{"a.lab.toml", "a.scene.toml", 0.02, 1e-3, 1e-3};

// The places along x of every line of a plot.
std::vector<std::vector<double>> LinesAlongX(const std::string& svg) {
  std::vector<std::vector<double>> lines;
  const std::regex line("<polyline points=\"([^\"]*)\"");
  for (std::sregex_iterator at(svg.begin(), svg.end(), line), end; at != end; ++at) {
    std::istringstream points((*at)[1].str());
    lines.emplace_back();
    for (std::string point; points >> point;) lines.back().push_back(std::stod(point));
  }
  return lines;
}

TEST(PlanReport, TheTargetIsDrawnFromTheFastestPlanToTheSlowest) {
  const auto folder = e2e::FreshFolder("plan_report_target");
  WritePlanReport(kQuestion, Answer(), folder / "p.html");
  const auto lines = LinesAlongX(e2e::ReadText(folder / "p.svg"));
  ASSERT_EQ(lines.size(), 3u);  // two families, the target
  std::vector<double> plans = lines[0];
  plans.insert(plans.end(), lines[1].begin(), lines[1].end());
  const auto [first, last] = std::minmax_element(plans.begin(), plans.end());
  EXPECT_EQ(lines[2], (std::vector<double>{*first, *last}));
}

TEST(PlanReport, ThePageSaysWhatItsMarksAre) {
  const auto folder = e2e::FreshFolder("plan_report_marks");
  WritePlanReport(kQuestion, Answer(), folder / "p.html");
  const std::string page = e2e::ReadText(folder / "p.html");
  EXPECT_THAT(page, HasSubstr("the ring is the recommended plan"));
  EXPECT_THAT(page, HasSubstr("Points are plans"));
}

// Below the sentence: the names of the columns, then the fastest of each family and what is
// recommended.
TEST(PlanReport, ColumnsOfTheTableStandBelowTheirNames) {
  testing::internal::CaptureStdout();
  const core::Json json = PrintPlanForTarget(kQuestion, Answer());
  std::istringstream out(testing::internal::GetCapturedStdout());
  std::vector<std::string> lines;
  for (std::string line; std::getline(out, line);) lines.push_back(line);
  ASSERT_GE(lines.size(), 5u);
  EXPECT_EQ(json.at("plans").size(), 4u);
  const std::size_t column = lines[1].find("error");
  ASSERT_NE(column, std::string::npos) << lines[1];
  const char* errors[] = {"1 % ", "1.5 % ", "1.5 % "};
  for (std::size_t row = 0; row < 3; ++row)
    EXPECT_EQ(lines[2 + row].substr(column, std::string(errors[row]).size()), errors[row]);
}

}  // namespace
}  // namespace luxfield::cli
