#include "luxfield/cli/reports/geometry_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::cli {
namespace {

using reconstruct::DetectionNoise;
using reconstruct::GeometryCalibration;
using reconstruct::GeometryParameter;
using reconstruct::ViewResidual;

using Rows = std::vector<std::vector<std::string>>;

// Metres in millimetres, radians in milliradians: what such a table is read in.
std::vector<std::string> Row(const GeometryParameter& p) {
  const double scale = p.unit == "m" || p.unit == "rad" ? 1e3 : 1;
  const std::string unit = p.unit == "m"     ? "mm"
                           : p.unit == "rad" ? "mrad"
                           : p.unit == "1"   ? ""
                                             : p.unit;
  const double sigma = scale * p.sigma;
  const int places =
      sigma > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 12) : 6;
  return {p.name, fmt::format("{:.{}f} +- {:.{}f}", scale * p.value, places, sigma, places), unit};
}

std::string NoiseText(const char* what, const DetectionNoise& noise) {
  return fmt::format(
      "{}: {} corners, {} left out; residuals {:.2g} px rms per axis where the frames' noise "
      "predicts {:.2g} (factor {:.3g})",
      what, noise.corners, noise.left_out, noise.rms_px, noise.predicted, noise.factor);
}

std::vector<std::string> NoiseTexts(const GeometryCalibration& c) {
  std::vector<std::string> texts;
  if (c.geometry.lens) texts.push_back(NoiseText("board", c.geometry.boards));
  texts.push_back(NoiseText("mask", c.geometry.masks));
  return texts;
}

std::string PlaceText(const GeometryCalibration& c) {
  double worst = 0;
  for (const auto& sigma : c.geometry.place_sigma_m)
    worst = std::max(worst, std::hypot(sigma.x, sigma.y));
  const auto middle = c.geometry.place_sigma_m[4];
  return fmt::format("place on the image plane: +- {:.2g} mm in the middle, {:.2g} mm at worst",
                     1e3 * std::hypot(middle.x, middle.y), 1e3 * worst);
}

// One point per corner and axis of all views of a kind.
template <typename Abscissa>
Plot ResidualPlot(const GeometryCalibration& c, const std::string& title,
                  const std::string& x_label, Abscissa abscissa) {
  Plot plot{.title = title,
            .x_label = x_label,
            .y_label = "residual / sigma",
            .series = {},
            .width = 900,
            .height = 300};
  for (const bool mask : {false, true})
    for (const int axis : {0, 1}) {
      Series series{.name = fmt::format("{}, {}", mask ? "mask" : "board", axis ? "row" : "column"),
                    .x = {},
                    .y = {},
                    .lines = false};
      for (std::size_t n = 0; n < c.views.size(); ++n) {
        if (c.views[n].mask != mask) continue;
        for (const ViewResidual& r : c.geometry.residuals[n]) {
          if (r.left_out) continue;
          series.x.push_back(abscissa(r, axis));
          series.y.push_back((axis ? r.residual_px.y : r.residual_px.x) / r.sigma_px);
        }
      }
      if (!series.x.empty()) plot.series.push_back(std::move(series));
    }
  return plot;
}

Plot CloudPlot(const GeometryCalibration& c) {
  Plot plot{.title = "Residuals",
            .x_label = "column, px",
            .y_label = "row, px",
            .series = {},
            .width = 460,
            .height = 460};
  for (const bool mask : {false, true}) {
    Series series{.name = mask ? "mask" : "board", .x = {}, .y = {}, .lines = false};
    for (std::size_t n = 0; n < c.views.size(); ++n)
      for (const ViewResidual& r : c.geometry.residuals[n]) {
        if (c.views[n].mask != mask || r.left_out) continue;
        series.x.push_back(r.residual_px.x);
        series.y.push_back(r.residual_px.y);
      }
    if (!series.x.empty()) plot.series.push_back(std::move(series));
  }
  return plot;
}

Rows ViewRows(const GeometryCalibration& c) {
  Rows rows{{"frame", "target", "corners", "left out", "rms, px", "chi^2 per axis"}};
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    const auto& view = c.views[n];
    double squares = 0, chi = 0;
    int used = 0, out = 0;
    for (const ViewResidual& r : c.geometry.residuals[n]) {
      if (r.left_out) {
        ++out;
        continue;
      }
      ++used;
      const double square = r.residual_px.x * r.residual_px.x + r.residual_px.y * r.residual_px.y;
      squares += square;
      chi += square / (r.sigma_px * r.sigma_px);
    }
    const std::string target =
        !view.mask
            ? (view.board == 0 ? "board on I" : fmt::format("board {}", view.board))
            : fmt::format("mask{}, stage ({:.4g}, {:.4g}) m", view.on_spacer ? " on spacer" : "",
                          view.setpoint_m.x, view.setpoint_m.y);
    rows.push_back({view.file, target, fmt::format("{}", used), fmt::format("{}", out),
                    fmt::format("{:.2g}", std::sqrt(squares / std::max(1, 2 * used))),
                    fmt::format("{:.2f}", chi / std::max(1, 2 * used))});
  }
  return rows;
}

}  // namespace

void PrintGeometryCalibration(const GeometryCalibration& c) {
  fmt::print("  {:<16}{:>28}\n", "", "value +- standard uncertainty");
  for (const GeometryParameter& p : c.geometry.parameters) {
    const auto row = Row(p);
    fmt::print("  {:<16}{:>28}  {}\n", row[0], row[1], row[2]);
  }
  fmt::print("  {}\n", PlaceText(c));
  for (const std::string& text : NoiseTexts(c)) fmt::print("  {}\n", text);
  for (const std::string& file : c.not_found) fmt::print("  no target found in {}\n", file);
}

void WriteGeometryReport(const GeometryCalibration& c, const std::filesystem::path& html) {
  HtmlPage page("Geometry calibration");
  for (const std::string& text : NoiseTexts(c)) page.Paragraph(text + ".");
  page.Paragraph(PlaceText(c) + ".");
  for (const std::string& file : c.not_found) page.Paragraph("No target found in " + file + ".");
  page.Heading("Parameters");
  Rows rows{{"", "value +- standard uncertainty", "unit"}};
  for (const GeometryParameter& p : c.geometry.parameters) rows.push_back(Row(p));
  page.Table(rows);
  page.Heading("Residuals");
  page.Raw(SvgPlot(CloudPlot(c)));
  const double middle_x = 0.5 * c.geometry.width, middle_y = 0.5 * c.geometry.height;
  page.Raw(SvgPlot(ResidualPlot(c, "Against the distance from the picture's middle", "distance, px",
                                [&](const ViewResidual& r, int) {
                                  return std::hypot(r.at.x - middle_x, r.at.y - middle_y);
                                })));
  page.Raw(SvgPlot(ResidualPlot(c, "Against the place within the pixel", "place, px",
                                [](const ViewResidual& r, int axis) {
                                  const double at = axis ? r.at.y : r.at.x;
                                  return at - std::floor(at);
                                })));
  page.Heading("Views");
  page.Table(ViewRows(c));
  core::WriteFileAtomically(html, page.Text());
}

}  // namespace luxfield::cli
