// luxfield photometry X.lf.exr [--sigma X.sigma.lf.exr] [-o X.html]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/photometry_report.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/lamp.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string file, sigma, ask, output;
  double c_step_deg = 15;
  std::optional<double> gamma_step_deg;
};

// What a file of sigma(C) says of how C came of E.
struct Solve {
  photometry::SolveMaps maps;
  std::string uncertainty;  // what follows for standard uncertainties
};

constexpr const char* kNoise =
    "Standard uncertainties (k = 1) are what the noise of the measurement leaves, from sigma(C); "
    "what all coefficients share (exposure times, drift, geometry, filters, calibration) is not in "
    "them: `luxfield budget` states it";

Solve SolveOf(const lightfield::LightField& sigma, const std::string& file) {
  const auto text = [&](const char* key) {
    const auto found = sigma.provenance.find(key);
    return found == sigma.provenance.end() ? std::string() : found->second;
  };
  const std::string solve = text("solve");
  if (solve == "none") return {{}, std::string(kNoise) + "."};
  if (solve == "regularised")
    throw InputError(file,
                     "belongs to a regularised solution, of which sigma does not say how "
                     "coefficients hang together",
                     "leave --sigma out, or reconstruct without --regularise");
  if (solve.empty())
    return {{},
            std::string(kNoise) +
                ". The file does not say how C was solved for, so coefficients are taken as "
                "independent, which overstates the uncertainty of flux, intensity and illuminance "
                "several times; `luxfield reconstruct --sigma` of this version says it."};
  reconstruct::KeptMoments kept;
  const auto& grid = sigma.geometry.grid;
  if (std::sscanf(text("kept_moments").c_str(), "%d %d", &kept.u, &kept.v) != 2 || kept.u < 0 ||
      kept.v < 0 || kept.u > reconstruct::kMostMoments || kept.v > reconstruct::kMostMoments)
    throw InputError(file,
                     fmt::format("luxfield:provenance.kept_moments = '{}' is no pair of numbers "
                                 "from 0 to {}",
                                 text("kept_moments"), reconstruct::kMostMoments),
                     "reconstruct again");
  const reconstruct::GramSolver solver(grid, kept);
  Solve found{{solver.u().map, solver.v().map}, std::string(kNoise)};
  found.uncertainty +=
      solve == "gram" ? "."
                      : ". How coefficients hang together is taken as behind ideal filters, which "
                        "the measured or displaced ones are near.";
  return found;
}

std::string SetSigma(photometry::Lamp& lamp, const std::string& file) {
  if (file.empty())
    return "No standard uncertainties: no --sigma was given (`luxfield reconstruct --sigma` writes "
           "it).";
  const auto sigma = lightfield::ReadLightFields(file);
  std::vector<photometry::SolveMaps> maps;
  std::string uncertainty;
  for (const auto& posed : sigma) {
    Solve solve = SolveOf(posed.field, file);
    uncertainty = solve.uncertainty;
    maps.push_back(std::move(solve.maps));
  }
  SetNoise(lamp, sigma, maps, file);
  return uncertainty;
}

// Gamma up to which the lamp shines with a tenth of its peak, by its field angle.
double EdgeGamma(const photometry::Distribution& d) {
  if (!d.field) return 60;
  const double off_axis = photometry::DirectionOf(d.peak_direction).gamma_deg;
  return off_axis + 0.5 * std::max(d.field->along_c0_deg.value, d.field->along_c90_deg.value);
}

// Of the usual steps, the largest that gives the beam eight angles.
double GammaStep(const photometry::Distribution& d) {
  for (const double step : {5.0, 2.5, 1.0, 0.5})
    if (8 * step <= EdgeGamma(d)) return step;
  return 0.25;
}

// One metre before the lamp, as wide as its beam, where nothing is asked for.
photometry::Asked AskedOf(const std::string& file, const photometry::Distribution& d) {
  if (!file.empty()) return photometry::ReadAsked(core::Config::FromFile(file));
  constexpr double kDistance_m = 1, kDegree = 0.017453292519943295;
  const double half = 1.2 * std::tan(std::clamp(EdgeGamma(d), 3.0, 60.0) * kDegree);
  const double width = 0.1 * std::ceil(20 * half);
  photometry::Asked asked;
  asked.planes = {photometry::PlaneBefore(kDistance_m, width, width, 51, 51)};
  return asked;
}

PhotometryReport ReportOf(const Options& options, const photometry::Lamp& lamp,
                          std::string uncertainty) {
  PhotometryReport report;
  report.file = options.file;
  report.sha256 = core::Sha256OfFile(options.file);
  report.uncertainty = std::move(uncertainty);
  report.distribution = photometry::DistributionOf(lamp);
  const auto asked = AskedOf(options.ask, report.distribution);
  if (lamp.unit == lightfield::FluxUnit::kWatt)
    report.distribution.remarks.push_back(
        "the unit of flux is W: these are radiometric quantities, not weighted by the eye");
  if (lamp.unit == lightfield::FluxUnit::kRelative)
    report.distribution.remarks.push_back(
        "the unit of flux is relative: numbers compare with each other alone");
  report.table = TableOf(lamp, options.c_step_deg,
                         options.gamma_step_deg.value_or(GammaStep(report.distribution)));
  for (const auto& point : asked.points) report.points.push_back(AnswerAt(lamp, point));
  for (const auto& eye : asked.eyes) report.eyes.push_back(AnswerFor(lamp, eye));
  for (const auto& plane : asked.planes) report.planes.push_back(AnswerOn(lamp, plane));
  return report;
}

bool EndsInOneOf(const std::string& path) {
  return path.ends_with(".html") || path.ends_with(".json") || path.ends_with(".csv");
}

core::Json Run(const Options& options) {
  if (!options.output.empty() && !EndsInOneOf(options.output))
    throw InputError(fmt::format(
        "--output = {} must end in .html, .json or .csv; name the output so", options.output));
  if (!options.ask.empty()) photometry::ReadAsked(core::Config::FromFile(options.ask));
  photometry::Lamp lamp = photometry::LampOf(lightfield::ReadLightFields(options.file));
  std::string uncertainty = SetSigma(lamp, options.sigma);
  const PhotometryReport report = ReportOf(options, lamp, std::move(uncertainty));
  core::Json json = ToJson(report);
  if (options.output.ends_with(".html"))
    core::WriteFileAtomically(options.output, PhotometryPage(report, lamp));
  if (options.output.ends_with(".csv"))
    core::WriteFileAtomically(options.output, PhotometryCsv(report));
  if (options.output.ends_with(".json")) core::WriteJson(options.output, json);
  PrintPhotometry(report);
  if (!options.output.empty()) fmt::print("wrote {}\n", options.output);
  return json;
}

}  // namespace

void AddPhotometry(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("photometry", [options] { return Run(*options); });
  verb.add_option("LIGHT-FIELD", options->file, "The .lf.exr of a lamp")
      ->required()
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("--sigma", options->sigma,
                  "The standard deviations of C that `luxfield reconstruct --sigma` wrote: every "
                  "number gets its standard uncertainty")
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("--ask", options->ask,
                  "An ask.toml: points and planes to light (docs/photometry.md); without it a "
                  "plane 1 m before the lamp");
  verb.add_option("-o,--output", options->output, "A .html page, .json or .csv to write")
      ->check(OutputFile());
  verb.add_option("--c-step", options->c_step_deg, "Degrees between C planes of the table")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 360.0));
  verb.add_option("--gamma-step", options->gamma_step_deg,
                  "Degrees between angles gamma of the table; by default by the beam, from 0.25 "
                  "to 5")
      ->check(CLI::Range(0.05, 90.0));
}

}  // namespace luxfield::cli
