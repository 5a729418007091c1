#include "luxfield/cli/reports/calibrate_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::cli {
namespace {

using reconstruct::ChannelCalibration;
using reconstruct::PhotonTransfer;
using reconstruct::Quantity;
using reconstruct::SensorCalibration;
using reconstruct::TransferPoint;

// "6.2493 +- 0.0031": the error with two digits, the value as many places.
std::string Format(const Quantity& q, double scale = 1) {
  const double sigma = scale * q.sigma;
  const int places =
      sigma > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 12) : 6;
  return fmt::format("{:.{}f} +- {:.{}f}", scale * q.value, places, sigma, places);
}

std::string Format(const std::optional<Quantity>& q) { return q ? Format(*q) : "not reached"; }

// Name, value with error, unit.
using Row = std::array<std::string, 3>;

std::vector<Row> Rows(const PhotonTransfer& t, const Quantity& prnu) {
  return {
      {"gain", Format(t.gain_e_per_dn), "electrons per DN"},
      {"read noise", Format(t.read_noise_e),
       t.read_noise_resolved ? "electrons" : "electrons: not resolved, raise the camera's gain"},
      {"black level", Format(t.offset_dn), "DN"},
      {"dark current", Format(t.dark_current_e_per_s), "electrons per second"},
      {"PRNU", Format(prnu, 100), "%"},
      {"saturation", Format(t.saturation_dn), "DN"},
      {"capacity", Format(t.capacity_e), "electrons"}};
}

std::vector<Row> Rows(const reconstruct::Linearity& l) {
  return {{"linearity", Format({l.largest.deviation, l.largest.sigma}, 100),
           fmt::format("% at most, at {:.3g} s ({} levels, chi^2 {:.3g} of {})",
                       l.largest.exposure_s, l.points.size(), l.chi_squared, l.degrees)},
          {"shutter", Format(l.exposure_offset_s, 1e6), "us longer than it says"},
          {"light", fmt::format("{:.3g}", 100 * l.repeatability),
           fmt::format("% scatter from frame to frame beyond noise{}",
                       l.by_monitor ? ", divided by the monitor" : "")}};
}

std::string Name(const SensorCalibration& c, const ChannelCalibration& channel) {
  if (c.channels.size() == 1) return "sensor";
  if (!channel.site) return fmt::format("channel {}", channel.channel);
  return fmt::format("channel {}, site {} of the mosaic's cell", channel.channel, *channel.site);
}

Plot TransferPlot(const ChannelCalibration& channel, const std::string& name) {
  Plot plot{.title = fmt::format("Photon transfer, {}", name),
            .x_label = "signal, DN above black",
            .y_label = "temporal variance less rounding, DN^2",
            .log_x = true,
            .log_y = true,
            .series = {},
            .width = 900,
            .height = 460};
  Series flats{.name = "flats", .x = {}, .y = {}, .lines = false};
  Series darks{.name = "darks", .x = {}, .y = {}, .lines = false};
  Series left_out{.name = "left out", .x = {}, .y = {}, .lines = false, .style = {}, .ring = true};
  Series model{.name = "fit R + g S", .x = {}, .y = {}, .lines = true};
  double low = 1e300, high = 0;
  for (const TransferPoint& p : channel.transfer.points) {
    Series& series = p.dark ? darks : flats;
    series.x.push_back(p.signal_dn);
    series.y.push_back(p.variance_dn2);
    if (!p.fitted) left_out.x.push_back(p.signal_dn), left_out.y.push_back(p.variance_dn2);
    if (p.signal_dn <= 0) continue;
    low = std::min(low, p.signal_dn);
    high = std::max(high, p.signal_dn);
  }
  constexpr int kSteps = 80;
  for (int k = 0; k <= kSteps && low < high; ++k) {
    const double s = low * std::pow(high / low, static_cast<double>(k) / kSteps);
    model.x.push_back(s);
    model.y.push_back(channel.transfer.read_variance_dn2.value +
                      channel.transfer.gain_dn_per_e.value * s);
  }
  plot.series = {flats, darks, model, left_out};
  return plot;
}

Plot ResidualPlot(const ChannelCalibration& channel, const std::string& name) {
  Plot plot{.title = fmt::format("Residuals of the fit, {}", name),
            .x_label = "signal, DN above black",
            .y_label = "(variance - fit) / standard error",
            .log_x = true,
            .log_y = false,
            .series = {},
            .width = 900,
            .height = 300};
  Series flats{.name = "flats", .x = {}, .y = {}, .lines = false};
  Series darks{.name = "darks", .x = {}, .y = {}, .lines = false};
  for (const TransferPoint& p : channel.transfer.points) {
    if (!p.fitted) continue;
    Series& series = p.dark ? darks : flats;
    series.x.push_back(p.signal_dn);
    series.y.push_back((p.variance_dn2 - p.model_dn2) / p.sigma_dn2);
  }
  plot.series = {flats, darks};
  return plot;
}

Plot LinearityPlot(const ChannelCalibration& channel, const std::string& name) {
  Plot plot{.title = fmt::format("Deviation from linearity, {}", name),
            .x_label = "signal, DN above black",
            .y_label = "deviation, %",
            .log_x = false,
            .log_y = false,
            .series = {},
            .width = 900,
            .height = 300};
  Series points{.name = "flats", .x = {}, .y = {}, .lines = false};
  Series above{.name = "+- 2 standard errors", .x = {}, .y = {}, .lines = true, .style = 5};
  Series below{.name = "", .x = {}, .y = {}, .lines = true, .style = 5};
  for (const auto& p : channel.linearity.points) {
    points.x.push_back(p.signal_dn);
    points.y.push_back(100 * p.deviation);
    above.x.push_back(p.signal_dn);
    above.y.push_back(200 * p.sigma);
    below.x.push_back(p.signal_dn);
    below.y.push_back(-200 * p.sigma);
  }
  plot.series = {points, above, below};
  return plot;
}

std::string OutlierText(const SensorCalibration& c) {
  return fmt::format("{} hot and {} dead pixels left out and listed", c.hot.size(), c.dead.size());
}

}  // namespace

void PrintSensorCalibration(const SensorCalibration& c) {
  fmt::print("  {:<14}{:>28}\n", "", "value +- standard error");
  const auto print = [](const std::vector<Row>& rows) {
    for (const auto& [name, value, unit] : rows)
      fmt::print("  {:<14}{:>28}  {}\n", name, value, unit);
  };
  print(Rows(c.transfer, c.prnu));
  fmt::print("  {:<14}{:>28}  of {} degrees of freedom\n", "fit, chi^2",
             fmt::format("{:.4g}", c.transfer.chi_squared), c.transfer.degrees);
  for (const ChannelCalibration& channel : c.channels) {
    if (c.channels.size() > 1) {
      fmt::print(" {}\n", Name(c, channel));
      print(Rows(channel.transfer, channel.prnu));
    }
    print(Rows(channel.linearity));
  }
  fmt::print("  {}\n", OutlierText(c));
}

void WriteSensorReport(const SensorCalibration& c, const std::filesystem::path& html) {
  HtmlPage page("Sensor calibration");
  page.Paragraph(
      fmt::format("{} x {} pixels, {} bit; {}.", c.width, c.height, c.bits, OutlierText(c)));
  for (const ChannelCalibration& channel : c.channels) {
    const std::string name = Name(c, channel);
    page.Heading(name);
    std::vector<std::vector<std::string>> table{{"", "value +- standard error", ""}};
    for (const auto& rows : {Rows(channel.transfer, channel.prnu), Rows(channel.linearity)})
      for (const auto& row : rows) table.emplace_back(row.begin(), row.end());
    page.Table(table);
    page.Raw(SvgPlot(TransferPlot(channel, name)));
    page.Raw(SvgPlot(ResidualPlot(channel, name)));
    page.Raw(SvgPlot(LinearityPlot(channel, name)));
  }
  page.Paragraph(
      "Ringed points are left out of the fit: next to saturation, or with less noise than rounding "
      "lets through.");
  core::WriteFileAtomically(html, page.Text());
}

}  // namespace luxfield::cli
