// luxfield reconstruct X.meas.exr -o X.lf.exr
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <vector>

#include "cli/program.h"
#include "core/file.h"
#include "reconstruct/reconstruct.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::vector<std::string> measurements;
  std::string output, sigma, filter;
  bool double_precision = false, non_negative = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".lf.exr", "--output");
  if (!options.sigma.empty()) RequireExtension(options.sigma, ".lf.exr", "--sigma");
  std::vector<lightfield::Measurements> measurements;
  std::string source;
  for (const std::string& file : options.measurements) {
    measurements.push_back(lightfield::ReadMeasurements(file));
    source += (source.empty() ? "" : " ") + core::Sha256OfFile(file);
  }
  reconstruct::ReconstructOptions how;
  how.precision =
      options.double_precision ? reconstruct::Precision::kDouble : reconstruct::Precision::kFloat;
  how.non_negative = options.non_negative;
  std::optional<lightfield::MeasuredFilter> filter;
  if (!options.filter.empty()) filter = lightfield::ReadMeasuredFilter(options.filter);
  how.filter = filter ? &*filter : nullptr;
  auto result = reconstruct::Reconstruct(measurements, how);
  auto& provenance = result.coefficients.provenance;
  provenance["measurements_sha256"] = source;
  provenance["non_negative"] = options.non_negative ? "yes" : "no";
  if (filter) provenance["filter_sha256"] = core::Sha256OfFile(options.filter);
  lightfield::WriteLightField(options.output, result.coefficients);
  if (!options.sigma.empty()) {
    result.sigma.provenance["sigma_of"] = source;
    lightfield::WriteLightField(options.sigma, result.sigma);
  }
  const auto& report = result.report;
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
  fmt::print("  random error expected {:.3g} % of the RMS of C (median sigma {:.4g})\n",
             100 * report.coefficients.sigma_relative, report.coefficients.sigma_median);
  fmt::print("  negative energy       {:.3g} % of the positive{}\n",
             100 * report.coefficients.negative_energy,
             report.non_negative ? ", before the non-negative solve removed it" : "");
  if (report.non_negative)
    fmt::print("  non-negative solve    {} pixels, {} iterations at most, {} above the tolerance\n",
               report.non_negative->pixels, report.non_negative->iterations,
               report.non_negative->unconverged);
  if (report.incomplete.incomplete)
    fmt::print(
        "  incomplete texels     {} of which {} with nothing known: smallest-norm solution, "
        "sigma widened by that prior\n",
        report.incomplete.incomplete, report.incomplete.unknown);
  return reconstruct::ToJson(report);
}

}  // namespace

void AddReconstruct(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "reconstruct", "Solve measurements for the coefficient images of the light field",
      [options] { return Run(*options); });
  verb.add_option("MEASUREMENTS", options->measurements,
                  "The .meas.exr of `luxfield merge`; several of one plan are solved together, "
                  "weighted by sigma")
      ->required();
  verb.add_option("--filter", options->filter,
                  "The filter as `luxfield filter measure` found it (.filter.exr), in place of the "
                  "ideal one");
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")->required();
  verb.add_option("--sigma", options->sigma,
                  "Write the standard deviation of C as a light field too (.lf.exr)");
  verb.add_flag("--non-negative", options->non_negative,
                "Solve with C >= 0, as the sampling estimators need");
  verb.add_flag("--double", options->double_precision,
                "Sweep in double precision instead of float");
}

}  // namespace luxfield::cli
