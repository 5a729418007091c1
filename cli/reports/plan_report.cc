#include "luxfield/cli/reports/plan_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/progress.h"

namespace luxfield::cli {
namespace {

using planning::PlanForTarget;
using planning::PlannedCapture;

constexpr char kCurveMark[] = "<!-- luxfield plan: capture time against accuracy -->\n";

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string Exposures(const PlannedCapture& plan) {
  const auto& e = plan.plan.exposure;
  std::string text = e.max_s > e.min_s ? fmt::format("ladder {:.4g} to {:.4g} ms down to {:g}",
                                                     1e3 * e.min_s, 1e3 * e.max_s, e.relevant_share)
                                       : fmt::format("one of {:.4g} ms", 1e3 * e.min_s);
  if (e.repeats > 1) text += fmt::format(", {} times", e.repeats);
  return text;
}

std::vector<std::string> FamiliesOf(const PlanForTarget& answer) {
  std::vector<std::string> families;
  for (const auto& plan : answer.plans)
    if (std::find(families.begin(), families.end(), plan.family) == families.end())
      families.push_back(plan.family);
  return families;
}

std::vector<PlannedCapture> OfFamily(const PlanForTarget& answer, const std::string& family) {
  std::vector<PlannedCapture> plans;
  std::copy_if(answer.plans.begin(), answer.plans.end(), std::back_inserter(plans),
               [&](const PlannedCapture& plan) { return plan.family == family; });
  return plans;
}

const std::vector<std::string> kColumns = {"",           "positions", "spacing, mm",
                                           "filter, mm", "time",      "error",
                                           "truncation", "noise",     "exposures"};

std::vector<std::string> Cells(const std::string& name, const PlannedCapture& plan) {
  const auto& grid = plan.plan.geometry.grid;
  return {name,
          fmt::format("{} x {}{}", grid.width, grid.height, plan.plan.dual ? " x 2" : ""),
          fmt::format("{:.4g}", 1e3 * grid.spacing_m),
          fmt::format("{:.4g}", 1e3 * grid.spacing_m * grid.basis.cells),
          core::FormatDuration(plan.capture_s),
          Percent(plan.error()),
          Percent(plan.truncation),
          Percent(plan.noise),
          Exposures(plan)};
}

// The recommended plan, and of every family the fastest that meets the target, else its best.
std::vector<std::vector<std::string>> Table(const PlanQuestion& question,
                                            const PlanForTarget& answer) {
  std::vector<std::vector<std::string>> rows{kColumns};
  for (const std::string& family : FamiliesOf(answer)) {
    const auto plans = OfFamily(answer, family);
    const PlannedCapture* fastest = planning::Fastest(plans, question.max_rel_error);
    rows.push_back(Cells(fastest ? family : family + " (misses)",
                         fastest ? *fastest : planning::MostAccurate(plans)));
  }
  if (answer.recommended) rows.push_back(Cells("recommended", *answer.recommended));
  return rows;
}

std::string CaptureText(const PlanForTarget& answer) {
  const auto& capture = *answer.capture;
  return fmt::format(
      "simulated capture of the recommended plan, all of the lab's errors on: error {} where {} is "
      "predicted without the bench's other errors, {} on the rig where {} is predicted",
      Percent(capture.error.value), Percent(answer.recommended->error()),
      core::FormatDuration(capture.rig_s), core::FormatDuration(answer.recommended->capture_s));
}

Plot Curve(const PlanQuestion& question, const PlanForTarget& answer) {
  Plot plot;
  plot.title = "Capture time against accuracy";
  plot.x_label = "time on the rig after warm-up, minutes";
  plot.y_label = "relative error of the picture's irradiance, %";
  plot.log_x = plot.log_y = true;
  plot.width = 900;
  plot.height = 520;
  double first = 0, last = 0;
  for (const std::string& family : FamiliesOf(answer)) {
    Series series;
    series.name = family;
    for (const auto& plan : OfFamily(answer, family)) {
      if (plan.error() > 1) continue;  // nobody's plan
      series.x.push_back(plan.capture_s / 60);
      series.y.push_back(100 * plan.error());
      first = first == 0 ? series.x.back() : std::min(first, series.x.back());
      last = std::max(last, series.x.back());
    }
    plot.series.push_back(std::move(series));
  }
  const double target = 100 * question.max_rel_error;
  plot.series.push_back(
      {.name = fmt::format("target, {:.3g} %", target), .x = {first, last}, .y = {target, target}});
  if (answer.capture && answer.recommended)
    plot.series.push_back({.name = "recommended, captured",
                           .x = {answer.capture->rig_s / 60},
                           .y = {100 * answer.capture->error.value},
                           .lines = false});
  if (answer.recommended)
    plot.series.push_back({.name = "recommended",
                           .x = {answer.recommended->capture_s / 60},
                           .y = {100 * answer.recommended->error()},
                           .lines = false,
                           .ring = true});
  return plot;
}

// What is left at each spacing once enough light was collected.
Plot Spacings(const PlanForTarget& answer) {
  Plot plot;
  plot.title = "Error that basis and spacing leave";
  plot.x_label = "spacing of the filters, mm";
  plot.y_label = "relative error without noise, %";
  plot.log_x = plot.log_y = true;
  plot.width = 900;
  plot.height = 420;
  for (const std::string& family : FamiliesOf(answer)) {
    std::map<double, double> least;
    for (const auto& plan : OfFamily(answer, family)) {
      const auto [at, added] =
          least.try_emplace(1e3 * plan.plan.geometry.grid.spacing_m, plan.truncation);
      if (!added) at->second = std::min(at->second, plan.truncation);
    }
    Series series;
    series.name = family;
    for (const auto& [spacing, truncation] : least) {
      series.x.push_back(spacing);
      series.y.push_back(100 * truncation);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

core::Json ToJson(const PlannedCapture& plan) {
  const auto& grid = plan.plan.geometry.grid;
  const auto& e = plan.plan.exposure;
  return {{"family", plan.family},
          {"grid_width", grid.width},
          {"grid_height", grid.height},
          {"spacing_m", grid.spacing_m},
          {"filter_width_m", grid.spacing_m * grid.basis.cells},
          {"exposure_min_s", e.min_s},
          {"exposure_max_s", e.max_s},
          {"relevant_share", e.relevant_share},
          {"repeats", e.repeats},
          {"frames", plan.frames},
          {"capture_s", plan.capture_s},
          {"rel_error", plan.error()},
          {"truncation", plan.truncation},
          {"noise", plan.noise}};
}

}  // namespace

core::Json PrintPlanForTarget(const PlanQuestion& question, const PlanForTarget& answer) {
  fmt::print("{} for {}, error of the picture's irradiance at most {}\n", question.lab,
             question.scene, Percent(question.max_rel_error));
  const auto rows = Table(question, answer);
  std::vector<std::size_t> widths(kColumns.size());
  for (const auto& row : rows)
    for (std::size_t k = 0; k + 1 < row.size(); ++k)  // no blanks behind the last
      widths[k] = std::max(widths[k], row[k].size());
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) fmt::print("  {:<{}}", row[k], widths[k]);
    fmt::print("\n");
  }
  fmt::print("  truth good to {}, the lamp's samples to {}\n", Percent(question.truth_error),
             Percent(question.samples_error));
  core::Json json{{"max_rel_error", question.max_rel_error},
                  {"truth_error", question.truth_error},
                  {"samples_error", question.samples_error},
                  {"captures", answer.captures},
                  {"plans", core::Json::array()}};
  for (const auto& plan : answer.plans) json["plans"].push_back(ToJson(plan));
  if (answer.recommended) json["recommended"] = ToJson(*answer.recommended);
  if (answer.capture && answer.recommended) {
    fmt::print("  {}\n", CaptureText(answer));
    json["captured"] = {{"rel_error", answer.capture->error.value},
                        {"rel_error_se", answer.capture->error.standard_error},
                        {"bench_error", answer.bench_error},
                        {"rig_s", answer.capture->rig_s},
                        {"flagged", answer.capture->flagged},
                        {"rejected", answer.capture->rejected},
                        {"wall_s", answer.capture->bench_s}};
  }
  return json;
}

std::filesystem::path CurveBeside(const std::filesystem::path& html) {
  auto svg = html;
  svg.replace_extension(".svg");
  core::RequireOwn(svg, html, kCurveMark);
  return svg;
}

void WritePlanReport(const PlanQuestion& question, const PlanForTarget& answer,
                     const std::filesystem::path& html) {
  HtmlPage page("Plan from a target");
  page.Paragraph(fmt::format(
      "{} for {}: the relative error of the picture's irradiance is to be at most {}. Of every "
      "family of filters the fastest plan that meets it, or else its most accurate one.",
      question.lab, question.scene, Percent(question.max_rel_error)));
  page.Table(Table(question, answer));
  if (!answer.limit.empty()) page.Paragraph("Out of reach: " + answer.limit + ".");
  if (answer.capture && answer.recommended) page.Paragraph(CaptureText(answer) + ".");
  page.Heading("Capture time against accuracy");
  page.Paragraph(
      "Points are plans that no other of their family beats. The error is that of model and noise "
      "together; the ring is the recommended plan's prediction, the point by it its simulated "
      "capture.");
  const std::string curve = kCurveMark + SvgPlot(Curve(question, answer));
  page.Raw(curve);
  page.Heading("Families and spacings");
  page.Raw(SvgPlot(Spacings(answer)));
  page.Paragraph(fmt::format(
      "The truth is the lamp's own irradiance by quadrature, good to {}; the samples of the lamp "
      "that plans were tried on are good to {}.",
      Percent(question.truth_error), Percent(question.samples_error)));
  core::WriteFileAtomically(html, page.Text());
  core::WriteFileAtomically(CurveBeside(html), curve);
}

}  // namespace luxfield::cli
