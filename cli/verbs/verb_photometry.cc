// luxfield photometry X.lf.exr [--sigma X.sigma.lf.exr] [-o X.html]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/reports/certificate.h"
#include "luxfield/cli/reports/photometry_report.h"
#include "luxfield/cli/shared_file.h"
#include "luxfield/cli/verbs/certificate_set_up.h"
#include "luxfield/cli/verbs/lamp_noise.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/photometry/answers.h"
#include "luxfield/photometry/lamp.h"
#include "luxfield/reconstruct/budget/budget_settings.h"

namespace luxfield::cli {
namespace {

using LightFields = std::vector<lightfield::PosedLightField>;

struct Options {
  std::string file, sigma, ask, output, session, uncertainty;
  double c_step_deg = 15;
  std::optional<double> gamma_step_deg;
};

// Of the usual steps, the largest that gives the beam eight angles.
double GammaStep(const photometry::Distribution& d) {
  for (const double step : {5.0, 2.5, 1.0, 0.5})
    if (8 * step <= EdgeGammaOf(d)) return step;
  return 0.25;
}

// NAME.toml of data/regulations.
std::filesystem::path RegulationFile(const std::string& name) {
  return SharedFile("data/regulations/" + name + ".toml");
}

photometry::Asked ReadAsked(const std::string& file) {
  return photometry::ReadAsked(core::Config::FromFile(file), RegulationFile);
}

// A plane one metre before the lamp, as wide as its beam, and an eye there, where nothing is asked for.
photometry::Asked AskedOf(const std::string& file, const photometry::Distribution& d) {
  if (!file.empty()) return ReadAsked(file);
  photometry::Asked asked;
  asked.planes = {PlaneOfBeam(d, 1)};
  asked.eyes = {photometry::EyeBefore(1)};
  return asked;
}

// The lamp as a weighting sees it; luminance, or the only channel, if none is named.
class WeighedLamps {
 public:
  WeighedLamps(const std::string& ask, const photometry::Asked& asked, const LightFields& fields,
               const photometry::Lamp& luminance, const LampNoise& noise)
      : luminance_(luminance) {
    for (const photometry::Weighting& one : asked.weightings) {
      auto lamp =
          photometry::LampOf(fields, one.factors, fmt::format("{}: weighting '{}'", ask, one.name));
      SetNoise(lamp, noise);
      weighed_.emplace(one.name, std::move(lamp));
    }
  }
  const photometry::Lamp& Of(const std::string& weighting) const {
    return weighting.empty() ? luminance_ : weighed_.at(weighting);
  }

 private:
  const photometry::Lamp& luminance_;
  std::map<std::string, photometry::Lamp> weighed_;
};

void Answer(const WeighedLamps& lamps, const photometry::Asked& asked, PhotometryReport* report) {
  report->weightings = asked.weightings;
  for (const auto& point : asked.points)
    report->points.push_back(AnswerAt(lamps.Of(point.weighting), point));
  for (const auto& plane : asked.planes)
    report->planes.push_back(AnswerOn(lamps.Of(plane.weighting), plane));
  for (const auto& line : asked.lines)
    report->lines.push_back(AnswerAlong(lamps.Of(line.weighting), line));
  for (const auto& volume : asked.volumes)
    report->volumes.push_back(AnswerIn(lamps.Of(volume.middle.weighting), volume));
  for (const auto& path : asked.paths)
    report->paths.push_back(DoseAlong(lamps.Of(path.weighting), path));
}

// Of planes and volumes whose smallest value noise has put below 0.
void AddUniformityRemarks(PhotometryReport* report) {
  const auto add = [&](const std::string& name, const photometry::ManyPoints& answer) {
    if (answer.least.value < 0 && answer.mean.value > 0)
      report->distribution.remarks.push_back(fmt::format(
          "the smallest value on '{}' is below 0, which is noise: its uniformity is left out",
          name));
  };
  for (const auto& answer : report->planes) add(answer.asked.name, answer);
  for (const auto& answer : report->volumes) add(answer.asked.middle.name, answer);
}

PhotometryReport ReportOf(const Options& options, const LightFields& fields,
                          const photometry::Lamp& lamp, const LampNoise& noise) {
  PhotometryReport report;
  report.file = options.file;
  report.sha256 = core::Sha256OfFile(options.file);
  report.uncertainty = noise.uncertainty;
  report.distribution = photometry::DistributionOf(lamp);
  const auto asked = AskedOf(options.ask, report.distribution);
  if (lamp.unit == lightfield::FluxUnit::kWatt)
    report.distribution.remarks.push_back(
        "the unit of flux is W: these are radiometric quantities, not weighted by the eye; there "
        "is "
        "no luminous area and no glare");
  if (lamp.unit == lightfield::FluxUnit::kRelative)
    report.distribution.remarks.push_back(
        "the unit of flux is relative: numbers compare with each other alone; there is no luminous "
        "area and no glare");
  report.table = TableOf(lamp, options.c_step_deg,
                         options.gamma_step_deg.value_or(GammaStep(report.distribution)));
  const auto colour = ColourLampOf(fields, noise.sigma, noise.maps, noise.file);
  if (colour)
    report.colour = ColourDistributionOf(*colour, report.table, report.distribution.peak_direction);
  report.quality = QualityOf(lamp, asked.quality);
  Answer(WeighedLamps(options.ask, asked, fields, lamp, noise), asked, &report);
  AddUniformityRemarks(&report);
  for (const auto& eye : asked.eyes) report.eyes.push_back(AnswerFor(lamp, eye));
  for (const auto& glare : asked.glare) report.glare.push_back(AnswerFor(lamp, glare));
  for (const auto& headlamp : asked.headlamps)
    report.headlamps.push_back(ReportOfHeadlamp(lamp, headlamp));
  return report;
}

// Quantities of the budget are the flux and the illuminance at the points that are asked for.
std::optional<reconstruct::ErrorBudget> BudgetOf(const Options& options,
                                                 const session::SessionReader& session,
                                                 const photometry::Lamp& lamp,
                                                 const PhotometryReport& report) {
  reconstruct::BudgetSettings settings;
  if (!options.uncertainty.empty())
    settings = reconstruct::ReadBudgetSettings(core::Config::FromFile(options.uncertainty));
  for (const auto& point : report.points) {
    const auto& g = lamp.fields[0].field.geometry;
    if (point.asked.weighting.empty() &&
        !HorizonCutsSupport(g, point.asked.p_m, point.asked.normal))
      settings.receivers.push_back({point.asked.name, point.asked.p_m, point.asked.normal});
  }
  return reconstruct::ComputeErrorBudget(session, settings);
}

Certificate CertificateOf(const Options& options, const photometry::Lamp& lamp,
                          const PhotometryReport& report) {
  Certificate certificate;
  const auto name_of = [](const std::string& file) {
    return std::filesystem::path(file).filename().string();
  };
  certificate.files.push_back({"light field", name_of(options.file), report.sha256});
  photometry::Asked asked;
  if (!options.ask.empty()) asked = ReadAsked(options.ask);
  certificate.texts = asked.certificate;
  const auto& quality = asked.quality;
  for (const auto& [role, file] :
       {std::pair<const char*, std::string>{"standard deviations", options.sigma},
        {"what was asked", options.ask},
        {"sizes of errors", options.uncertainty},
        {"responsivity", quality.responsivity.string()},
        {"spectrum of the lamp", quality.lamp_spectrum.string()},
        {"spectrum of the calibration", quality.calibration_spectrum.string()},
        {"calibration of the sensor", quality.sensor_calibration.string()}})
    if (!file.empty()) certificate.files.push_back({role, name_of(file), core::Sha256OfFile(file)});
  if (options.session.empty()) return certificate;
  const session::SessionReader session(options.session);
  certificate.set_up = SetUpOf(session);
  for (HashedFile& file : FilesOf(session)) certificate.files.push_back(std::move(file));
  certificate.budget = BudgetOf(options, session, lamp, report);
  return certificate;
}

constexpr const char* kCertificateJson = ".cert.json";

bool IsCertificate(const std::string& path) {
  return path.ends_with(".pdf") || path.ends_with(kCertificateJson);
}
bool EndsInOneOf(const std::string& path) {
  return IsCertificate(path) || path.ends_with(".html") || path.ends_with(".json") ||
         path.ends_with(".csv");
}

core::Json Run(const Options& options) {
  if (!options.output.empty() && !EndsInOneOf(options.output))
    throw InputError(fmt::format(
        "--output = {} must end in .html, .pdf, .cert.json, .json or .csv; name the output so",
        options.output));
  if (!IsCertificate(options.output) && !(options.session + options.uncertainty).empty())
    throw InputError(
        "--session and --uncertainty are of a certificate; end --output in .pdf or .cert.json, or "
        "drop them");
  if (options.session.empty() && !options.uncertainty.empty())
    throw InputError("--uncertainty is of a session's budget; give --session too");
  const bool headlamps = !options.ask.empty() && !ReadAsked(options.ask).headlamps.empty();
  const auto fields = lightfield::ReadLightFields(options.file);
  photometry::Lamp lamp = photometry::LampOf(fields);
  if (headlamps && lamp.unit != lightfield::FluxUnit::kLumen)
    throw InputError(options.file,
                     fmt::format("is in {}, and regulations of headlamps ask for candela",
                                 lamp.unit == lightfield::FluxUnit::kWatt ? "W" : "relative units"),
                     "measure it with a plan of unit = \"lm\", or drop [[headlamp]]");
  const LampNoise noise = ReadLampNoise(options.sigma);
  SetNoise(lamp, noise);
  const PhotometryReport report = ReportOf(options, fields, lamp, noise);
  core::Json json = ToJson(report);
  if (options.output.ends_with(".html"))
    core::WriteFileAtomically(options.output, PhotometryPage(report, lamp));
  if (options.output.ends_with(".csv"))
    core::WriteFileAtomically(options.output, PhotometryCsv(report));
  if (IsCertificate(options.output)) {
    const Certificate certificate = CertificateOf(options, lamp, report);
    if (options.output.ends_with(".pdf"))
      WriteCertificate(options.output, certificate, report, lamp);
    else
      core::WriteJson(options.output, CertificateJson(certificate, report));
  } else if (options.output.ends_with(".json")) {
    core::WriteJson(options.output, json);
  }
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
                  "An ask.toml: points, lines, planes, volumes, paths, eyes, glare, headlamps "
                  "(docs/photometry.md); without it a plane and an eye 1 m before "
                  "the lamp");
  verb.add_option("-o,--output", options->output,
                  "A .html page, .json or .csv to write; or a certificate, .pdf or .cert.json")
      ->check(OutputFile());
  verb.add_option("--session", options->session,
                  "The session that the lamp was measured in: the certificate gets its set-up and "
                  "its error budget")
      ->check(InputFile({core::FileKind::kLightFieldSession, core::FileKind::kSession}));
  verb.add_option("--uncertainty", options->uncertainty,
                  "A budget.toml of the session's errors, as of `luxfield budget`");
  verb.add_option("--c-step", options->c_step_deg, "Degrees between C planes of the table")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 360.0));
  verb.add_option("--gamma-step", options->gamma_step_deg,
                  "Degrees between angles gamma of the table; by default by the beam, from 0.25 "
                  "to 5")
      ->check(CLI::Range(0.05, 90.0));
}

}  // namespace luxfield::cli
