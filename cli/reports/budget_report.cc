#include "luxfield/cli/reports/budget_report.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_bars.h"
#include "luxfield/core/file.h"

namespace luxfield::cli {
namespace {

using reconstruct::ErrorBudget;
using reconstruct::ErrorSource;
using reconstruct::kErrorSources;
using reconstruct::QuantityBudget;

const char* const kNotStated = "not stated";
const char* const kEstimatedBasis =
    "the basis' row is estimated from what coarser grids lose of this lamp; smallest_spot_m in "
    "--uncertainty states how fine the lamp is instead";

std::string Percent(double sigma, double value) {
  if (value == 0) return fmt::format("{:.3g}", sigma);
  const double relative = sigma / std::abs(value);
  return fmt::format("{:.3g} %", relative < 1e-12 ? 0 : 100 * relative);  // rounding is no error
}

// "0.32 %" of a source, or that nobody states it; nothing for a meter that was not used.
std::string Share(const QuantityBudget& quantity, int source) {
  const auto& sigma = quantity.sigma[static_cast<std::size_t>(source)];
  return sigma ? Percent(*sigma, quantity.value) : kNotStated;
}

std::vector<int> SourcesOf(const ErrorBudget& budget) {
  std::vector<int> sources;
  for (int s = 0; s < kErrorSources; ++s)
    if (budget.scale || s != static_cast<int>(ErrorSource::kMeter)) sources.push_back(s);
  return sources;
}

std::string NameOf(const ErrorBudget& budget, int source) {
  const bool estimated = budget.basis_estimated && source == static_cast<int>(ErrorSource::kBasis);
  return std::string(reconstruct::ErrorSourceName(static_cast<ErrorSource>(source))) +
         (estimated ? ", estimated" : "");
}

std::string ValueText(const QuantityBudget& quantity) {
  return fmt::format("{:.5g} +- {:.2g}{}{} ({})", quantity.value, quantity.Total(),
                     quantity.unit.empty() ? "" : " ", quantity.unit,
                     Percent(quantity.Total(), quantity.value));
}

std::vector<const QuantityBudget*> All(const ErrorBudget& budget) {
  std::vector<const QuantityBudget*> all;
  for (const auto& quantity : budget.quantities) all.push_back(&quantity);
  if (budget.scale) all.push_back(&budget.scale->factor);
  return all;
}

std::string ScaleText(const reconstruct::MeterScale& scale) {
  double largest = 0;
  for (const double r : scale.residuals) largest = std::max(largest, std::abs(r));
  return fmt::format(
      "light meter: readings {}, factor {}; largest residual {:.2g} %, chi^2 {:.3g} of {}",
      scale.residuals.size(), ValueText(scale.factor), 100 * largest, scale.chi_squared,
      scale.degrees);
}

std::string TiltText(const reconstruct::TiltEffect& tilt) {
  return "planes not parallel, in no row: " + TextOf(tilt);
}

// What the lab wrote about its meter; empty: nothing.
std::string MeterText(const reconstruct::Meter& meter) {
  std::string text;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) text += fmt::format("{}{} {}", text.empty() ? "" : "; ", name, value);
  };
  add("serial number", meter.serial_number);
  add("calibrated", meter.calibration_date);
  add("V(lambda):", meter.v_lambda);
  return text.empty() ? text : "Light meter: " + text;
}

}  // namespace

void PrintErrorBudget(const ErrorBudget& budget) {
  for (const QuantityBudget* quantity : All(budget)) {
    fmt::print("{}: {}\n", quantity->name, ValueText(*quantity));
    for (const int s : SourcesOf(budget))
      fmt::print("  {:<17}{:>12}\n", NameOf(budget, s), Share(*quantity, s));
  }
  if (budget.scale) fmt::print("{}\n", ScaleText(*budget.scale));
  if (budget.tilt) fmt::print("{}\n", TiltText(*budget.tilt));
  if (budget.basis_estimated) fmt::print("{}\n", kEstimatedBasis);
}

void WriteBudgetReport(const ErrorBudget& budget, const std::optional<reconstruct::Meter>& meter,
                       const std::string& session, const std::filesystem::path& html) {
  HtmlPage page("Error budget");
  page.Paragraph(fmt::format(
      "Session {}. Standard deviations; the total is the root of the sum of squares of the sources "
      "whose sizes are stated or estimated.",
      session));
  if (budget.basis_estimated) page.Paragraph(kEstimatedBasis);
  if (budget.scale) page.Paragraph(ScaleText(*budget.scale));
  if (const std::string text = meter ? MeterText(*meter) : ""; !text.empty()) page.Paragraph(text);
  if (budget.tilt) page.Paragraph(TiltText(*budget.tilt));
  std::vector<std::vector<std::string>> table{{"quantity", "value", "unit", "sigma", "relative"}};
  for (const QuantityBudget* q : All(budget))
    table.push_back({q->name, fmt::format("{:.5g}", q->value), q->unit,
                     fmt::format("{:.2g}", q->Total()), Percent(q->Total(), q->value)});
  page.Table(table);
  for (const QuantityBudget* q : All(budget)) {
    std::vector<Bar> bars;
    for (const int s : SourcesOf(budget)) {
      const auto& sigma = q->sigma[static_cast<std::size_t>(s)];
      bars.push_back({NameOf(budget, s), sigma, Share(*q, s)});
    }
    bars.push_back({"total", q->Total(), Percent(q->Total(), q->value), true});
    page.Heading(q->name);
    page.Raw(SvgBars(ValueText(*q), bars));
  }
  core::WriteFileAtomically(html, page.Text());
}

}  // namespace luxfield::cli
