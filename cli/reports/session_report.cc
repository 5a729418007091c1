#include "luxfield/cli/reports/session_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_map.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"

namespace luxfield::cli {
namespace {

using capture::Judgement;
using capture::ReviewedEpoch;
using capture::ReviewedPosition;
using capture::SessionReview;
using capture::TimedValue;
using capture::TimeSeries;
using capture::Verdict;

constexpr int kBins = 240;            // points of a plot
constexpr std::size_t kEvents = 60;   // rows of the table
constexpr std::size_t kReasons = 12;  // likewise
constexpr int kPlotWidth = 900;

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string Seconds(double exposure_s) {
  return exposure_s < 1 ? fmt::format("{:.4g} ms", 1e3 * exposure_s)
                        : fmt::format("{:.4g} s", exposure_s);
}

const char* Word(Verdict verdict) {
  return verdict == Verdict::kGood ? "good" : verdict == Verdict::kLook ? "look" : "bad";
}
const char* Colour(Verdict verdict) {
  return verdict == Verdict::kGood ? "#2f8a4c" : verdict == Verdict::kLook ? "#b8860b" : "#b00020";
}

// Time on the session's axis, in the unit that suits its duration.
struct TimeAxis {
  double unit_s = 1;
  std::string label;

  explicit TimeAxis(double duration_s) {
    const char* name = "seconds";
    if (duration_s > 3 * 3600)
      unit_s = 3600, name = "hours";
    else if (duration_s > 300)
      unit_s = 60, name = "minutes";
    label = fmt::format("{} since the session began", name);
  }
};

Plot TimePlot(const TimeAxis& axis, const std::string& title, const std::string& y_label) {
  Plot plot;
  plot.title = title;
  plot.x_label = axis.label;
  plot.y_label = y_label;
  plot.width = kPlotWidth;
  plot.height = 300;
  return plot;
}

// The means, and the extremes as thin companions where they differ.
void AddSeries(const TimeAxis& axis, const std::string& name, const TimeSeries& values, int style,
               Plot& plot, double scale = 1, double offset = 0) {
  Series mean{.name = name, .x = {}, .y = {}, .style = style}, low, high;
  low.style = high.style = 5;
  bool spread = false;
  for (const capture::Bin& bin : capture::Binned(values, kBins)) {
    mean.x.push_back(bin.t_s / axis.unit_s);
    mean.y.push_back(scale * (bin.mean + offset));
    low.y.push_back(scale * (bin.min + offset));
    high.y.push_back(scale * (bin.max + offset));
    spread |= bin.max > bin.min;
  }
  low.x = high.x = mean.x;
  if (spread) {
    low.name = "least and largest";
    plot.series.push_back(std::move(low));
    plot.series.push_back(std::move(high));
  }
  plot.series.push_back(std::move(mean));
}

std::string VerdictList(const SessionReview& review) {
  std::string html = "<ul style=\"list-style: none; padding: 0\">\n";
  for (const Judgement& judgement : capture::Judge(review))
    html += fmt::format(
        "<li style=\"margin: 0.3em 0; padding-left: 4em; text-indent: -4em\"><b style=\"display: "
        "inline-block; width: 4em; text-indent: 0; color: {}\">{}</b>{}</li>\n",
        Colour(judgement.verdict), Word(judgement.verdict), EscapeXml(judgement.text));
  return html + "</ul>\n";
}

void WriteProgress(const SessionReview& review, const TimeAxis& axis, HtmlPage& page) {
  page.Heading("Timeline");
  page.Paragraph(fmt::format(
      "{} from the first line of the journal to its last; {} frames, {}, {} exposures that only "
      "chose others.",
      core::FormatDuration(review.duration_s), review.counts.frames,
      FormatBytes(review.counts.bytes), review.counts.probes));
  Plot plot = TimePlot(axis, "Progress", "frames committed");
  Series paused{.name = "paused", .x = {}, .y = {}, .lines = false, .style = 1};
  Series suspended{.name = "suspended", .x = {}, .y = {}, .lines = false, .style = 3};
  Series cut{.name = "cut short", .x = {}, .y = {}, .lines = false, .style = 4};
  double frames = 0;
  for (const ReviewedEpoch& epoch : review.epochs) {
    Series series{.name = plot.series.empty() ? "frames" : "",
                  .x = {epoch.begin_s / axis.unit_s},
                  .y = {frames},
                  .style = 0};
    const std::size_t step = std::max<std::size_t>(1, epoch.committed.size() / kBins);
    for (std::size_t n = step - 1; n < epoch.committed.size(); n += step) {
      series.x.push_back(epoch.committed[n].t_s / axis.unit_s);
      series.y.push_back(epoch.committed[n].value);
    }
    frames += epoch.frames;
    series.x.push_back(epoch.end_s / axis.unit_s);
    series.y.push_back(frames);
    plot.series.push_back(std::move(series));
    const bool last = &epoch == &review.epochs.back();
    if (epoch.sealed || (last && !epoch.paused && !epoch.suspended)) continue;
    Series& mark = epoch.paused ? paused : epoch.suspended ? suspended : cut;
    mark.x.push_back(epoch.end_s / axis.unit_s);
    mark.y.push_back(frames);
  }
  for (Series* mark : {&paused, &suspended, &cut})
    if (!mark->x.empty()) plot.series.push_back(std::move(*mark));
  page.Raw(SvgPlot(plot));
  std::vector<std::vector<std::string>> rows{{"after", "UTC", "what"}};
  for (std::size_t n = 0; n < std::min(kEvents, review.events.size()); ++n) {
    const auto& event = review.events[n];
    rows.push_back({core::FormatDuration(event.t_s), event.utc, event.what});
  }
  page.Table(rows);
  if (review.events.size() > kEvents)
    page.Paragraph(fmt::format("The other {} events are in the journal and in what --json writes.",
                               review.events.size() - kEvents));
}

void WriteDrift(const SessionReview& review, const TimeAxis& axis, HtmlPage& page) {
  page.Heading("Lamp drift");
  const bool references = !review.lamp.reference_ratio.empty(),
             meter = !review.lamp.meter_ratio.empty();
  if (!references && !meter) {
    page.Paragraph("This session has neither drift references nor readings of a light meter.");
    return;
  }
  if (!references) page.Paragraph("This session has no drift references.");
  if (!meter) page.Paragraph("This session has no readings of a light meter.");
  Plot plot = TimePlot(axis, "The lamp over what it was at first", "change, %");
  const char* const colours[] = {"R", "G", "B"};
  for (const auto& [channel, ratio] : review.lamp.reference_ratio)
    AddSeries(axis,
              review.lamp.reference_ratio.size() == 1
                  ? "reference frames"
                  : fmt::format("reference frames, {}", colours[std::clamp(channel, 0, 2)]),
              ratio, channel, plot, 100, -1);
  if (!review.lamp.suspended_ratio.empty()) {
    AddSeries(axis, "while suspended", review.lamp.suspended_ratio, 6, plot, 100, -1);
    plot.series.back().lines = false;
  }
  if (meter) AddSeries(axis, "light meter", review.lamp.meter_ratio, 3, plot, 100, -1);
  page.Raw(SvgPlot(plot));
  if (review.lamp.reference_over_meter.size() > 1) {
    Plot apart = TimePlot(axis, "References over light meter", "change, %");
    AddSeries(axis, "", review.lamp.reference_over_meter, 0, apart, 100, -1);
    page.Raw(SvgPlot(apart));
    page.Paragraph(
        "What both see is the lamp; what only the references see is camera, shutter or filter.");
  }
}

CellMap MapOf(const SessionReview& review, const std::string& title,
              const std::function<MapCell(const ReviewedPosition&)>& cell) {
  CellMap map{.title = title, .column_label = "i", .row_label = "j", .cells = {}};
  for (const ReviewedPosition& position : review.positions) {
    MapCell c = position.whole ? cell(position) : MapCell{};
    if (!position.whole) c.text = "not captured";
    c.column = position.i;
    c.row = position.j;
    map.cells.push_back(std::move(c));
  }
  return map;
}

MapCell ShareCell(const std::optional<double>& share) {
  MapCell cell;
  cell.value = share;
  cell.text = !share ? "" : *share == 0 ? "0" : fmt::format("{:.2g}%", 100 * *share);
  return cell;
}

MapCell CountCell(int count) {
  MapCell cell;
  cell.value = count;
  cell.text = std::to_string(count);
  return cell;
}

void WriteMaps(const std::vector<CellMap>& maps, HtmlPage& page) {
  std::string html = "<div class=\"row\">\n";
  for (const CellMap& map : maps) html += SvgMap(map);
  page.Raw(html + "</div>\n");
}

void WriteExposures(const SessionReview& review, HtmlPage& page) {
  page.Heading("Exposures");
  if (review.exposures.empty()) {
    page.Paragraph("No exposure of this session counts yet.");
    return;
  }
  const bool levels = std::any_of(review.exposures.begin(), review.exposures.end(),
                                  [](const auto& e) { return e.brightest.has_value(); });
  std::vector<std::vector<std::string>> rows{{"exposure", "frames", "flagged",
                                              "brightest pixel: least", "median", "largest", "mean",
                                              "saturated", "at or below black"}};
  for (const auto& e : review.exposures) {
    std::vector<std::string> row{Seconds(e.exposure_s), std::to_string(e.frames),
                                 std::to_string(e.flagged)};
    for (int k = 0; k < 3; ++k)
      row.push_back(e.brightest ? Percent((*e.brightest)[static_cast<std::size_t>(k)]) : "");
    row.push_back(e.mean ? Percent(*e.mean) : "");
    row.push_back(Percent(e.saturated_share));
    row.push_back(Percent(e.black_share));
    rows.push_back(std::move(row));
  }
  page.Paragraph(levels ? "Levels are those above black over the range from black to saturation; "
                          "shares are of the usable pixels."
                        : "session.json states no black level and saturation, so levels are left "
                          "out; shares are of the usable pixels.");
  page.Table(rows);
  if (levels && review.exposures.size() > 1) {
    Plot plot;
    plot.title = "Levels";
    plot.x_label = "exposure, s";
    plot.y_label = "of the range, %";
    plot.log_x = plot.log_y = true;
    plot.width = kPlotWidth;
    plot.height = 300;
    Series most{.name = "brightest pixel", .x = {}, .y = {}, .style = 0};
    Series least{.name = "its least and largest over frames", .x = {}, .y = {}, .style = 5};
    Series highest{.name = "", .x = {}, .y = {}, .style = 5};
    Series mean{.name = "mean", .x = {}, .y = {}, .style = 1};
    for (const auto& e : review.exposures) {
      if (!e.brightest || !e.mean) continue;
      for (Series* s : {&most, &least, &highest, &mean}) s->x.push_back(e.exposure_s);
      least.y.push_back(100 * (*e.brightest)[0]);
      most.y.push_back(100 * (*e.brightest)[1]);
      highest.y.push_back(100 * (*e.brightest)[2]);
      mean.y.push_back(100 * *e.mean);
    }
    plot.series = {least, highest, most, mean};
    page.Raw(SvgPlot(plot));
  }
  if (review.positions.empty()) return;
  page.Paragraph(
      "Of every filter position, the worst of its brackets: pixels that are saturated even in the "
      "shortest exposure are lost, those at or below black even in the longest carry no light.");
  WriteMaps({MapOf(review, "Saturated in the shortest exposure",
                   [](const auto& p) { return ShareCell(p.saturated_share); }),
             MapOf(review, "Too dark in the longest exposure",
                   [](const auto& p) { return ShareCell(p.black_share); })},
            page);
}

void WriteReshoots(const SessionReview& review, HtmlPage& page) {
  page.Heading("Re-shoots");
  if (review.counts.rejected == 0 && review.counts.flagged == 0) {
    page.Paragraph("No frame failed its checks.");
    return;
  }
  page.Paragraph(fmt::format(
      "{} exposures failed their checks and were taken again, {} of them in darks, references and "
      "frames of no position; {} frames failed at every attempt and are kept, flagged.",
      review.counts.rejected, review.counts.rejected_elsewhere, review.counts.flagged));
  std::vector<std::vector<std::string>> rows{{"exposures", "why", "for instance"}};
  for (std::size_t n = 0; n < std::min(kReasons, review.reasons.size()); ++n) {
    const auto& reason = review.reasons[n];
    rows.push_back({std::to_string(reason.frames), reason.reason, reason.example});
  }
  page.Table(rows);
  if (review.reasons.size() > kReasons)
    page.Paragraph(fmt::format("{} other reasons are in what --json writes.",
                               review.reasons.size() - kReasons));
  if (!review.positions.empty())
    WriteMaps({MapOf(review, "Taken again", [](const auto& p) { return CountCell(p.rejected); }),
               MapOf(review, "Flagged", [](const auto& p) { return CountCell(p.flagged); })},
              page);
}

void WriteTemperature(const SessionReview& review, const TimeAxis& axis, HtmlPage& page) {
  page.Heading("Temperature and dark level");
  if (review.sensor.temperature_c.empty()) {
    page.Paragraph("The camera tells no temperature.");
  } else {
    Plot plot = TimePlot(axis, "Sensor temperature", "degrees C");
    AddSeries(axis, "", review.sensor.temperature_c, 1, plot);
    page.Raw(SvgPlot(plot));
  }
  if (review.sensor.dark_dn.empty()) {
    page.Paragraph("This session has no darks.");
    return;
  }
  Plot plot = TimePlot(axis, fmt::format("Darks of {}", Seconds(review.sensor.dark_exposure_s)),
                       "mean less calibrated black, DN");
  Series darks{.name = "", .x = {}, .y = {}, .lines = false};
  for (const capture::Bin& bin : capture::Binned(review.sensor.dark_dn, kBins)) {
    darks.x.push_back(bin.t_s / axis.unit_s);
    darks.y.push_back(bin.mean);
  }
  plot.series = {darks};
  page.Raw(SvgPlot(plot));
}

void WriteStage(const SessionReview& review, HtmlPage& page) {
  page.Heading("Stage");
  Series series{.name = "", .x = {}, .y = {}, .lines = false};
  double sum = 0, largest = 0;
  for (const ReviewedPosition& p : review.positions) {
    if (!p.residual_m) continue;
    const double u = 1e6 * (*p.residual_m)[0], v = 1e6 * (*p.residual_m)[1];
    series.x.push_back(u);
    series.y.push_back(v);
    sum += u * u + v * v;
    largest = std::max(largest, std::hypot(u, v));
  }
  if (series.x.empty()) {
    page.Paragraph("No filter position was captured.");
    return;
  }
  const auto n = static_cast<double>(series.x.size());
  page.Paragraph(fmt::format(
      "Set points less read-back over {} positions: rms {:.3g} um, largest {:.3g} um. What the "
      "encoder does not see is not in it; merge takes the filter to be where the stage read back.",
      series.x.size(), std::sqrt(sum / n), largest));
  if (largest < 1e-6) return;  // rounding of the plan's coordinates
  Plot plot;
  plot.title = "Set point less read-back";
  plot.x_label = "u, um";
  plot.y_label = "v, um";
  plot.width = 480;
  plot.height = 420;
  plot.series = {series};
  page.Raw(SvgPlot(plot));
}

void WriteSupply(const SessionReview& review, const TimeAxis& axis, HtmlPage& page) {
  page.Heading("Lamp supply");
  if (review.lamp.voltage_v.empty() && review.lamp.current_a.empty()) {
    page.Paragraph("No supply that measures voltage or current was logged.");
    return;
  }
  const auto plot_of = [&](const char* title, const char* unit, const TimeSeries& series,
                           int style) {
    if (series.empty()) return;
    Plot plot = TimePlot(axis, title, unit);
    plot.height = 240;
    AddSeries(axis, "", series, style, plot);
    page.Raw(SvgPlot(plot));
  };
  plot_of("Voltage", "V", review.lamp.voltage_v, 0);
  plot_of("Current", "A", review.lamp.current_a, 1);
}

std::string Cell(const core::Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

void WriteDevices(const SessionReview& review, HtmlPage& page) {
  page.Heading("Devices");
  std::vector<std::vector<std::string>> rows{{"role", "device"}};
  for (const auto& [role, identity] : review.setup.devices.items())
    rows.push_back({role, Cell(identity)});
  for (const auto& [name, value] : review.setup.software.items())
    rows.push_back({"software " + name, Cell(value)});
  page.Table(rows);
  for (const ReviewedEpoch& epoch : review.epochs)
    if (epoch.devices != review.setup.devices)
      page.Paragraph(
          fmt::format("Epoch {} had other devices: {}", epoch.number, epoch.devices.dump()));
  std::vector<std::vector<std::string>> camera{{"camera", ""}};
  for (const auto& [key, value] : review.setup.camera.items()) {
    const bool list = value.is_array() && value.size() > 8;  // defects
    camera.push_back({key, list ? fmt::format("{} entries", value.size()) : Cell(value)});
  }
  page.Table(camera);
}

void WriteVerification(const SessionReview& review, HtmlPage& page) {
  page.Heading("Files");
  if (!review.check) {
    page.Paragraph(
        "This page read the journal, whose lines vouch for each other, and the sizes of the files. "
        "Whether every byte is the one written, `luxfield verify SESSION` tells.");
    return;
  }
  if (review.check->problems.empty()) {
    page.Paragraph(
        fmt::format("Every byte was checked: {} frames match their hashes, {} positions "
                    "are whole.",
                    review.check->frames, review.check->positions));
    return;
  }
  std::vector<std::vector<std::string>> rows{{"problems"}};
  for (const auto& problem : review.check->problems) {
    rows.push_back({problem});
    if (rows.size() > kEvents) break;
  }
  page.Table(rows);
}

}  // namespace

void PrintSessionReview(const SessionReview& review, const std::string& session) {
  fmt::print("{}: {} \"{}\", {}\n", session, review.plan.kind, review.plan.name,
             core::FormatDuration(review.duration_s));
  for (const Judgement& judgement : capture::Judge(review))
    fmt::print("  {:<5} {}\n", Word(judgement.verdict), judgement.text);
}

void WriteSessionReport(const SessionReview& review, const std::string& session,
                        const std::filesystem::path& html) {
  HtmlPage page("Session " + (review.plan.name.empty() ? session : review.plan.name));
  page.Paragraph(fmt::format("Session {}, a plan of kind {}{}; plan {}.", session, review.plan.kind,
                             review.epochs.empty() ? "" : ", begun " + review.epochs.front().utc,
                             review.plan.id.substr(0, 12)));
  page.Raw(VerdictList(review));
  const TimeAxis axis(review.duration_s);
  WriteProgress(review, axis, page);
  WriteDrift(review, axis, page);
  WriteExposures(review, page);
  WriteReshoots(review, page);
  WriteTemperature(review, axis, page);
  if (review.plan.kind == "light-field") WriteStage(review, page);
  WriteSupply(review, axis, page);
  WriteDevices(review, page);
  WriteVerification(review, page);
  core::WriteFileAtomically(html, page.Text());
}

}  // namespace luxfield::cli
