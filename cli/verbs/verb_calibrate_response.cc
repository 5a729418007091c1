// luxfield calibrate response IMAGES... -o X.cal.json
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/html_page.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/cli/verbs/verb_calibrate.h"
#include "luxfield/reconstruct/calibrate/response/calibrate_response.h"
#include "luxfield/version.h"

namespace luxfield::cli {
namespace {

using reconstruct::FittedResponse;
using reconstruct::ResponseCalibration;

struct Options {
  std::vector<std::filesystem::path> images;
  std::vector<double> exposures_s;
  std::string output, report, method = "debevec";
  int samples = 2000;
};

std::string ChannelName(const ResponseCalibration& calibration, std::size_t channel) {
  constexpr std::array kNames = {"red", "green", "blue"};
  return calibration.channels.size() == 1 ? "grey" : kNames[channel];
}

// A head, and a row for every channel.
std::vector<std::vector<std::string>> Rows(const ResponseCalibration& calibration) {
  std::vector<std::vector<std::string>> rows{
      {"", "codes", "to", "samples", "chi^2 of", "error of I, % at quarters"}};
  for (std::size_t k = 0; k < calibration.channels.size(); ++k) {
    const FittedResponse& c = calibration.channels[k];
    std::string errors;
    for (const double share : {0.25, 0.5, 0.75, 0.9})
      errors += fmt::format("{}{:.2g}", errors.empty() ? "" : "  ",
                            100 * c.curve.Sigma(share * c.curve.saturation_code));
    rows.push_back({ChannelName(calibration, k), fmt::format("{}", c.curve.low_code()),
                    fmt::format("{}", c.curve.high_code()), fmt::format("{}", c.samples),
                    fmt::format("{:.3g} of {:.0f}", c.chi_squared, c.degrees), errors});
  }
  return rows;
}

void Print(const ResponseCalibration& calibration) {
  for (const auto& row : Rows(calibration))
    fmt::print("  {:<7}{:>8}{:>8}{:>9}{:>18}{:>28}\n", row[0], row[1], row[2], row[3], row[4],
               row[5]);
}

void WriteReport(const ResponseCalibration& calibration, const std::filesystem::path& html) {
  HtmlPage page("Response calibration");
  page.Paragraph(fmt::format("{} bit, {} pictures of {:.4g} s to {:.4g} s, method {}.",
                             calibration.bits, calibration.exposures_s.size(),
                             calibration.exposures_s.front(), calibration.exposures_s.back(),
                             reconstruct::ResponseMethodName(calibration.method)));
  page.Table(Rows(calibration));
  Plot curves{.title = "Response",
              .x_label = "exposure, in that of the reference code",
              .y_label = "code",
              .log_x = true,
              .log_y = false,
              .series = {},
              .width = 900,
              .height = 460};
  Plot errors{
      .title = "Standard error of the exposure that a code stands for, and one pixel's noise",
      .x_label = "code",
      .y_label = "%",
      .log_x = false,
      .log_y = true,
      .series = {},
      .width = 900,
      .height = 300};
  for (std::size_t k = 0; k < calibration.channels.size(); ++k) {
    const auto& curve = calibration.channels[k].curve;
    const std::string name = ChannelName(calibration, k);
    constexpr int kRedGreenBlue[] = {1, 2, 0};  // the styles of these colours
    const int style = calibration.channels.size() == 3 ? kRedGreenBlue[k] : static_cast<int>(k);
    Series response{.name = name, .x = {}, .y = curve.code, .style = style};
    Series sigma{.name = name, .x = curve.code, .y = {}, .style = style};
    Series noise{
        .name = name + ", noise", .x = curve.noise_code, .y = {}, .lines = false, .style = style};
    for (const double g : curve.log_exposure) response.x.push_back(std::exp(g));
    for (const double s : curve.sigma) sigma.y.push_back(100 * s);
    for (const double s : curve.noise) noise.y.push_back(100 * s);
    curves.series.push_back(response);
    errors.series.push_back(sigma);
    errors.series.push_back(noise);
  }
  page.Raw(SvgPlot(curves));
  page.Raw(SvgPlot(errors));
  core::WriteFileAtomically(html, page.Text());
}

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".cal.json", "--output");
  if (!options.report.empty()) RequireExtension(options.report, ".html", "--report");
  const auto stack = reconstruct::ReadPictureStack(options.images, options.exposures_s);
  reconstruct::CalibrateResponseOptions how;
  how.fit.method = reconstruct::ResponseMethodFromName(options.method);
  how.samples = options.samples;
  ResponseCalibration calibration = reconstruct::CalibrateResponse(stack, how);
  std::string hashes;
  for (const auto& image : options.images) hashes += core::Sha256OfFile(image);
  calibration.provenance = {{"images_sha256", core::Sha256(hashes)},
                            {"software", "luxfield " LUXFIELD_VERSION}};
  reconstruct::WriteResponseCalibration(options.output, calibration);
  fmt::print("{}: {} bit, {} pictures of {:.4g} s to {:.4g} s\n", options.output, calibration.bits,
             stack.pictures.size(), calibration.exposures_s.front(),
             calibration.exposures_s.back());
  Print(calibration);
  if (!options.report.empty()) WriteReport(calibration, options.report);
  return reconstruct::ToJson(calibration);
}

}  // namespace

void AddCalibrateResponse(Program& program, CLI::App& group) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(group, "response",
                                   "The response curve of a camera that is not linear, from "
                                   "pictures of one scene with different "
                                   "exposure times",
                                   [options] { return Run(*options); });
  verb.add_option("IMAGES", options->images, "PNG, JPEG or TIFF, 8 or 16 bit")
      ->required()
      ->check(InputFile({core::FileKind::kPhotograph}));
  verb.add_option("-o,--output", options->output, "The .cal.json to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--exposure", options->exposures_s,
                  "Exposure times in seconds, one for each picture (default: their Exif)")
      ->delimiter(',');
  verb.add_option("--method", options->method,
                  "debevec (smooth), robertson (not smoothed), polynomial, or debevec-1997 as "
                  "published, of 8-bit pictures, to compare with")
      ->check(CLI::IsMember({"debevec", "robertson", "polynomial", "debevec-1997"}));
  verb.add_option("--samples", options->samples,
                  "Pixels of flat places a channel; histogram levels of debevec-1997")
      ->check(CLI::Range(200, 100000));
  verb.add_option("--report", options->report, "An .html page with curves, errors and noise")
      ->check(OutputFile());
}

}  // namespace luxfield::cli
