#include "luxfield/cli/reports/demo_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/capture/take/capture.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/merge/merge_session_json.h"
#include "luxfield/reconstruct/solve/report_json.h"
#include "luxfield/render/film/film.h"
#include "luxfield/web/lamp_page.h"

namespace luxfield::cli {
namespace {

using planning::DemoResult;

// The coefficient images of channel 0 side by side, as they lie on F (j upwards), reduced to `cell`
// pixels each by means.
core::Image ContactSheet(const lightfield::LightField& field, int cell) {
  const auto& g = field.geometry;
  core::Image sheet(g.grid.width * (cell + 1) - 1, g.grid.height * (cell + 1) - 1, 1);
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const auto image = field.image(g.grid.index(i, j), 0);
      for (int row = 0; row < cell; ++row)
        for (int column = 0; column < cell; ++column) {
          const int r0 = row * g.lattice.height / cell,
                    r1 = std::max(r0 + 1, (row + 1) * g.lattice.height / cell);
          const int c0 = column * g.lattice.width / cell,
                    c1 = std::max(c0 + 1, (column + 1) * g.lattice.width / cell);
          double sum = 0;
          for (int r = r0; r < r1; ++r)
            for (int c = c0; c < c1; ++c)
              sum += image[static_cast<std::size_t>(r) * g.lattice.width + c];
          sheet.at(0, (g.grid.height - 1 - j) * (cell + 1) + row, i * (cell + 1) + column) =
              static_cast<float>(sum / ((r1 - r0) * (c1 - c0)));
        }
    }
  return sheet;
}

core::Image AbsoluteDifference(const core::Image& a, const core::Image& b) {
  core::Image out = a;
  for (std::size_t k = 0; k < out.data.size(); ++k) out.data[k] = std::abs(out.data[k] - b.data[k]);
  return out;
}

std::string Percent(double value) { return fmt::format("{:.3g} %", 100 * value); }

Plot ExposurePlot(const DemoResult& result) {
  Plot plot{"Exposures chosen per position",
            "position, in the order of capture",
            "exposure time, s",
            false,
            true,
            {},
            900,
            320};
  Series shortest{"shortest of the bracket", {}, {}, true},
      longest{"longest of the bracket", {}, {}, true};
  for (std::size_t k = 0; k < result.shortest_s.size(); ++k) {
    shortest.x.push_back(double(k));
    longest.x.push_back(double(k));
  }
  shortest.y = result.shortest_s;
  longest.y = result.longest_s;
  plot.series = {longest, shortest};
  return plot;
}

void WritePictures(const std::filesystem::path& folder, const DemoResult& result) {
  const auto& frame = result.frame;
  // Headlights span decades: a lower exposure than the default keeps the hot spot below white.
  render::ToneMapping mapping;
  mapping.k = 0.4;
  render::WritePng(folder / "picture.png", render::ToneMap(frame.radiance, mapping));
  render::WriteFalseColour(folder / "irradiance.png", frame.irradiance, "illuminance",
                           render::IrradianceUnitName(frame.unit));
  render::WriteFalseColour(folder / "radiance.png", frame.radiance, "luminance",
                           render::RadianceUnitName(frame.unit));
  const auto unit = lightfield::FluxUnitName(result.truth.geometry.unit) + "/sr/m4";
  const core::Image measured = ContactSheet(result.coefficients, 72),
                    truth = ContactSheet(result.truth, 72);
  const auto scale = render::AutomaticScale(truth);
  render::WriteFalseColour(folder / "coefficients.png", measured, "C", unit, scale);
  render::WriteFalseColour(folder / "truth.png", truth, "C", unit, scale);
  render::WriteFalseColour(folder / "coefficient_error.png", AbsoluteDifference(measured, truth),
                           "|error|", unit, scale);
}

core::Json Summary(const DemoResult& result) {
  core::Json stages = core::Json::array();
  for (const auto& stage : result.stages)
    stages.push_back({{"name", stage.name},
                      {"wall_s", stage.wall_s},
                      {"rel_rmse", stage.error.rel_rmse},
                      {"rel_l2", stage.error.rel_l2},
                      {"projection_rel_rmse", stage.projection.rel_rmse},
                      {"projection_rel_l2", stage.projection.rel_l2},
                      {"of", stage.of}});
  const auto& pictures = result.pictures;
  const auto& flux = result.flux;
  return {{"stages", stages},
          {"total_wall_s", result.total_wall_s},
          {"judging_wall_s", result.judging_s},
          {"non_negative",
           {{"wall_s", result.non_negative_s},
            {"rel_rmse", result.non_negative_error.rel_rmse},
            {"rel_l2", result.non_negative_error.rel_l2},
            {"projection_rel_rmse", result.non_negative_projection.rel_rmse},
            {"projection_rel_l2", result.non_negative_projection.rel_l2}}},
          {"estimator", result.estimator},
          {"device", result.device},
          {"capture", capture::ToJson(result.capture)},
          {"merge", reconstruct::ToJson(result.merge)},
          {"reconstruct", reconstruct::ToJson(result.reconstruction)},
          {"picture_mean_lab", pictures.lamp.mean_lab},
          {"picture_rel_rmse", pictures.lamp.rel_rmse},
          {"projection_mean_lab", pictures.projection.mean_lab},
          {"projection_rel_rmse", pictures.projection.rel_rmse},
          {"floor_mean_lab", pictures.floor.mean_lab},
          {"floor_rel_rmse", pictures.floor.rel_rmse},
          {"floor",
           {{"radiance_rel_rmse", result.floor.rel_rmse},
            {"radiance_rel_l2", result.floor.rel_l2},
            {"irradiance_rel_rmse", result.floor_irradiance.rel_rmse},
            {"irradiance_rel_l2", result.floor_irradiance.rel_l2}}},
          {"shadowed_mean_lab", pictures.shadowed.mean_lab},
          {"shadowed_rel_rmse", pictures.shadowed.rel_rmse},
          {"lamp_picture",
           {{"mean_lab_se", pictures.reference.mean_lab},
            {"rel_rmse_se", pictures.reference.rel_rmse}}},
          {"flux",
           {{"lamp", flux.lamp},
            {"lamp_se", flux.lamp_se},
            {"measured", flux.measured},
            {"non_negative", flux.non_negative},
            {"projection", flux.projection},
            {"error", flux.measured / flux.lamp - 1}}}};
}

// The measured lamp as a page of its own (docs/web.md), which the report shows.
void EmbedLamp(const std::filesystem::path& folder, const DemoResult& result, HtmlPage& page) {
  web::FitOptions fit;  // coarser than export's, which takes its time
  fit.max_error = 0.02;
  fit.max_bytes = 120 * 1000;
  fit.receivers = 300;
  web::WriteLampPage(folder / "lamp.html", result.coefficients,
                     {"The lamp as measured", "headlight.signed.lf.exr", ""}, fit);
  page.Heading("The lamp in a room");
  page.Paragraph(
      "lamp.html, lit by the measured near field: drag the lamp, the view, the sliders; point for "
      "illuminance. `luxfield export` makes such pages of any lamp, with smaller errors.");
  page.Raw(
      "<iframe src=\"lamp.html\" title=\"A room lit by the measured lamp\" loading=\"lazy\" "
      "style=\"width:100%;height:42rem;border:1px solid #ccc\"></iframe>\n");
}

void StageTable(const DemoResult& result, HtmlPage& page) {
  std::vector<std::vector<std::string>> rows{{"stage", "time", "RMSE / mean", "RMSE / RMS",
                                              "floor, RMSE / mean", "from the projection",
                                              "of what"}};
  for (const auto& stage : result.stages) {
    const bool solved = stage.name == "reconstruct";
    rows.push_back({stage.name, core::FormatDuration(stage.wall_s), Percent(stage.error.rel_rmse),
                    Percent(stage.error.rel_l2),
                    solved                   ? Percent(result.floor.rel_rmse)
                    : stage.name == "render" ? Percent(result.floor_irradiance.rel_rmse)
                                             : "",
                    Percent(stage.projection.rel_rmse), stage.of});
    if (solved)
      rows.push_back({"  with C >= 0", core::FormatDuration(result.non_negative_s),
                      Percent(result.non_negative_error.rel_rmse),
                      Percent(result.non_negative_error.rel_l2), Percent(result.floor.rel_rmse),
                      Percent(result.non_negative_projection.rel_rmse),
                      "non-negative coefficients, against the same"});
  }
  rows.push_back({"total", core::FormatDuration(result.total_wall_s), "", "", "", "", ""});
  page.Table(rows);
}

}  // namespace

core::Json WriteDemoReport(const std::filesystem::path& folder, const DemoResult& result) {
  WritePictures(folder, result);
  core::Json summary = Summary(result);

  HtmlPage page("luxfield demo: a simulated headlight, measured and rendered");
  page.Paragraph(
      "A simulated lab with all of its errors on was captured, merged and solved as a real one "
      "would be. The pictures are lit by "
      "what was measured; every error is against the simulated lamp itself, whose rays are traced "
      "to filters, planes and surfaces and which no stage has seen. Beside it: the error of the "
      "lamp's projection onto the same filter positions, the floor that no measurement on this "
      "grid "
      "gets below, and how far the stage is from that projection.");
  page.Pictures({{"picture.png",
                  fmt::format("The scene, {} with traced shadows on {}, exponential tone operator",
                              result.estimator, result.device)},
                 {"irradiance.png", "Illuminance on the surfaces (false colour, logarithmic)"}});
  page.Heading("Time and error per stage");
  StageTable(result, page);
  EmbedLamp(folder, result, page);
  const auto& pictures = result.pictures;
  page.Heading("Pictures and flux");
  page.Table(
      {{"", "mean Lab", "RMSE / mean"},
       {"lit by the measurement, without shadows, against the lamp",
        fmt::format("{:.3f}", pictures.lamp.mean_lab), Percent(pictures.lamp.rel_rmse)},
       {"floor: lit by the best that the grid holds of the lamp",
        fmt::format("{:.3f}", pictures.floor.mean_lab), Percent(pictures.floor.rel_rmse)},
       {"lit by the measurement, against the projection",
        fmt::format("{:.3f}", pictures.projection.mean_lab), Percent(pictures.projection.rel_rmse)},
       {"picture.exr with its samples and shadows, against the lamp",
        fmt::format("{:.3f}", pictures.shadowed.mean_lab), Percent(pictures.shadowed.rel_rmse)},
       {"standard error of the lamp's own picture",
        fmt::format("{:.3f}", pictures.reference.mean_lab), Percent(pictures.reference.rel_rmse)}});
  const auto& flux = result.flux;
  const auto unit = lightfield::FluxUnitName(result.truth.geometry.unit);
  const auto flux_row = [&](const char* name, double value) {
    return std::vector<std::string>{name, fmt::format("{:.5g} {}", value, unit),
                                    fmt::format("{:+.3f} %", 100 * (value / flux.lamp - 1))};
  };
  page.Table({{"flux through the image plane", "", "against the lamp"},
              {"lamp", fmt::format("{:.5g} +- {:.1g} {}", flux.lamp, flux.lamp_se, unit), ""},
              flux_row("measured", flux.measured),
              flux_row("measured, C >= 0", flux.non_negative),
              flux_row("floor", flux.projection)});
  page.Heading("Capture");
  page.Table({{"", ""},
              {"positions",
               fmt::format("{} of {}", result.capture.positions, result.capture.positions_total)},
              {"frames", fmt::format("{}", result.capture.frames)},
              {"taken again after a failed check", fmt::format("{}", result.capture.rejected)},
              {"kept with a flag", fmt::format("{}", result.capture.flagged)},
              {"lamp level over the session",
               fmt::format("{:.5f} to {:.5f}", result.merge.least_lamp_factor,
                           result.merge.largest_lamp_factor)},
              {"time on the rig", core::FormatDuration(result.capture.rig_s)}});
  page.Raw(SvgPlot(ExposurePlot(result)));
  page.Heading("Reconstruction");
  std::vector<std::vector<std::string>> solve{{"", ""}};
  const auto& report = result.reconstruction;
  solve.push_back({"condition number of the system", fmt::format("{:.4g}", report.condition)});
  solve.push_back(
      {"gain of white noise, units of 1/h^2", fmt::format("{:.3g}", report.noise_gain)});
  solve.push_back({"random error expected, sqrt(sum sigma^2 / sum C^2)",
                   Percent(report.coefficients.sigma_relative)});
  solve.push_back({"negative energy before the non-negative solve",
                   Percent(report.coefficients.negative_energy)});
  solve.push_back(
      {"texels that some filter never saw", fmt::format("{}", report.incomplete.incomplete)});
  page.Table(solve);
  page.Pictures({{"coefficients.png", "Coefficient images as reconstructed"},
                 {"truth.png", "The truth, same scale"},
                 {"coefficient_error.png", "Absolute error, same scale"}});
  page.Heading("Files");
  std::vector<std::vector<std::string>> files{{"file", "size"}};
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ".exr")
      paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths)
    files.push_back(
        {path.filename().string(), FormatBytes(double(std::filesystem::file_size(path)))});
  page.Table(files);
  core::WriteFileAtomically(folder / "report.html", page.Text());
  core::WriteJson(folder / "summary.json", summary);
  return summary;
}

}  // namespace luxfield::cli
