// luxfield reconstruct X.meas.exr -o X.lf.exr
#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>
#include <vector>

#include "luxfield/cli/memory_option.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/verb_reconstruct.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/warning.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/reconstruct/solve/reconstruct_bands.h"
#include "luxfield/reconstruct/solve/report_json.h"

namespace luxfield::cli {
namespace {

// A number, or nothing for "auto".
std::optional<double> Lambda(const std::string& text) {
  if (text == "auto") return {};
  double lambda = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), lambda);
  if (error != std::errc{} || end != text.data() + text.size())
    throw InputError(
        fmt::format("--regularise '{}' is neither a number nor `auto`; give one of them", text));
  return lambda;
}

void PrintRegularisation(const reconstruct::RegularisationSummary& r) {
  fmt::print(
      "  regularised           lambda {:.4g}{}: noise {:.3g} % of the RMS of C ({:.3g} % without), "
      "bias {:.3g} % (estimated; at most {:.3g} %), of the flux {:+.2g} %\n",
      r.lambda, r.chosen ? ", of least estimated error" : "", 100 * r.noise, 100 * r.noise_before,
      100 * r.bias, 100 * r.worst_bias, 100 * r.flux_bias);
}

void PrintKept(const reconstruct::ReconstructionReport& report) {
  constexpr const char* kNames[] = {"nothing", "the flux", "flux and first moments"};
  const auto [u, v] = report.kept;
  fmt::print("  kept as measured      {}{}\n",
             u == v ? kNames[u] : fmt::format("{} along u, {} along v", kNames[u], kNames[v]),
             report.moment_residual ? fmt::format(" (that of a point of light to {:.2g} %)",
                                                  100 * *report.moment_residual)
                                    : "");
}

reconstruct::ReconstructionReport InMemory(const reconstruct::ReconstructFiles& files,
                                           const reconstruct::ReconstructOptions& how) {
  std::vector<lightfield::Measurements> measurements;
  reconstruct::SourceHashes sources;
  for (const auto& file : files.measurements) {
    measurements.push_back(lightfield::ReadMeasurements(file));
    sources.measurements.push_back(core::Sha256OfFile(file));
  }
  if (!files.filter.empty()) sources.filter = core::Sha256OfFile(files.filter);
  auto result = reconstruct::Reconstruct(measurements, how);
  reconstruct::StateProvenance(how, sources, &result);
  lightfield::WriteLightField(files.output, result.coefficients);
  if (!files.sigma.empty()) lightfield::WriteLightField(files.sigma, result.sigma);
  return std::move(result.report);
}

// Within --memory, or as it comes.
reconstruct::ReconstructionReport Solve(const ReconstructVerbOptions& options,
                                        const reconstruct::ReconstructOptions& how) {
  const reconstruct::ReconstructFiles files = FilesOf(options);
  const auto memory = MemoryLeft(options.memory);
  if (!memory) return InMemory(files, how);
  const int rows = reconstruct::BandRows(files, *memory),
            all = lightfield::ReadMeasurementGeometry(files.measurements[0]).lattice.height;
  if (rows == all) return InMemory(files, how);
  if (how.regularise || how.metric == reconstruct::NonNegativeMetric::kIrradiance)
    throw InputError(fmt::format(
        "{} takes sums over all texels, and they do not fit into --memory {}; give it {} MiB more, "
        "or leave it out",
        how.regularise ? "--regularise" : "--non-negative-metric irradiance", options.memory,
        ((reconstruct::BandBytes(files, all) - *memory) >> 20) + 1));
  return reconstruct::ReconstructInBands(files, how, rows);
}

core::Json Run(const ReconstructVerbOptions& options) {
  RequireExtension(options.output, ".lf.exr", "--output");
  if (!options.sigma.empty()) RequireExtension(options.sigma, ".lf.exr", "--sigma");
  reconstruct::ReconstructOptions how = HowToReconstruct(options);
  std::optional<lightfield::MeasuredFilter> filter;
  if (!options.filter.empty()) {
    filter = lightfield::ReadMeasuredFilter(options.filter);
    how.filter = &*filter;
  }
  const reconstruct::ReconstructionReport report = Solve(options, how);
  fmt::print("{}: {} coefficient images\n", options.output, report.images);
  fmt::print(
      "  condition number      {:.4g}; white noise times {:.3g}, worst mode times {:.3g} (units "
      "of 1/h^2)\n",
      report.condition, report.noise_gain, report.worst_gain);
  if (report.solve == "separable" || report.solve == "general")
    fmt::print("  forward model         {}{}\n", report.solve,
               report.filter_noise ? fmt::format("; filter known to {:.2g} % but for what its "
                                                 "photographs share",
                                                 100 * *report.filter_noise)
                                   : "");
  PrintKept(report);
  fmt::print("  random error expected {:.3g} % of the RMS of C (median sigma {:.4g})\n",
             100 * report.coefficients.sigma_relative, report.coefficients.sigma_median);
  fmt::print("  negative energy       {:.3g} % of the positive{}\n",
             100 * report.coefficients.negative_energy,
             report.non_negative ? ", before the non-negative solve removed it" : "");
  if (report.non_negative)
    fmt::print(
        "  non-negative solve    nearest in {}: {} pixels, {} iterations at most, {} above the "
        "tolerance\n",
        options.metric, report.non_negative->pixels, report.non_negative->iterations,
        report.non_negative->unconverged);
  if (report.regularisation) PrintRegularisation(*report.regularisation);
  if (report.incomplete.incomplete)
    fmt::print(
        "  incomplete texels     {} of which {} with nothing known: smallest-norm solution, "
        "sigma widened by that prior\n",
        report.incomplete.incomplete, report.incomplete.unknown);
  for (const std::string& warning : report.warnings) core::Warn(warning);
  return reconstruct::ToJson(report);
}

}  // namespace

reconstruct::ReconstructOptions HowToReconstruct(const ReconstructVerbOptions& options) {
  reconstruct::ReconstructOptions how;
  how.keep = reconstruct::KeepFromName(options.keep);
  how.metric = reconstruct::NonNegativeMetricFromName(options.metric);
  how.precision =
      options.double_precision ? reconstruct::Precision::kDouble : reconstruct::Precision::kFloat;
  how.non_negative = options.non_negative;
  how.regularise = !options.regularise.empty();
  if (how.regularise) how.lambda = Lambda(options.regularise);
  return how;
}

reconstruct::ReconstructFiles FilesOf(const ReconstructVerbOptions& options) {
  reconstruct::ReconstructFiles files;
  files.measurements.assign(options.measurements.begin(), options.measurements.end());
  files.filter = options.filter;
  files.output = options.output;
  files.sigma = options.sigma;
  return files;
}

void AddReconstruct(Program& program) {
  auto options = std::make_shared<ReconstructVerbOptions>();
  CLI::App& verb = program.AddVerb("reconstruct", [options] { return Run(*options); });
  AddReconstructOptions(verb, options);
}

void AddReconstructOptions(CLI::App& verb, const std::shared_ptr<ReconstructVerbOptions>& options) {
  verb.add_option("MEASUREMENTS", options->measurements,
                  "The .meas.exr of `luxfield merge`; several of one plan are solved together, "
                  "weighted by sigma")
      ->required()
      ->check(InputFile({core::FileKind::kMeasurements}));
  verb.add_option("--filter", options->filter,
                  "The filter as `luxfield filter measure` found it (.filter.exr), in place of the "
                  "ideal one")
      ->check(InputFile({core::FileKind::kMeasuredFilter}));
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--sigma", options->sigma,
                  "Write the standard deviation of C as a light field too (.lf.exr)")
      ->check(OutputFile());
  CLI::Option* non_negative = verb.add_flag("--non-negative", options->non_negative,
                                            "Solve with C >= 0; pictures do not need it");
  verb.add_option(
          "--non-negative-metric", options->metric,
          "Nearest in which sense: `coefficients`, texel by texel, or `irradiance`, in what "
          "all receivers see, for sharp cut-offs; minutes for a large light field")
      ->capture_default_str()
      ->needs(non_negative);
  verb.add_option("--regularise", options->regularise,
                  "Coefficients smoother from filter to filter than the data ask for: lambda, or "
                  "`auto` for the one of least estimated error. The report states the bias; "
                  "--sigma holds the noise alone");
  verb.add_option("--keep", options->keep,
                  "What the solution has of the measurements without projection where the lamp "
                  "lies inside the grid: `moments` (flux and first moments over the filters), "
                  "`flux`, or `none` for least squares alone");
  verb.add_flag("--double", options->double_precision,
                "Sweep in double precision instead of float");
  AddMemoryOption(verb, options->memory,
                  "images of more are solved in bands of rows, to the same file");
}

}  // namespace luxfield::cli
