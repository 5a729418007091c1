// luxfield reconstruct X.meas.exr -o X.lf.exr
#include <fmt/format.h>

#include <memory>

#include "cli/program.h"
#include "core/file.h"
#include "reconstruct/reconstruct.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string measurements, output, sigma;
  bool double_precision = false, non_negative = false;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".lf.exr", "--output");
  if (!options.sigma.empty()) RequireExtension(options.sigma, ".lf.exr", "--sigma");
  const auto measurements = lightfield::ReadMeasurements(options.measurements);
  reconstruct::ReconstructOptions how;
  how.precision =
      options.double_precision ? reconstruct::Precision::kDouble : reconstruct::Precision::kFloat;
  how.non_negative = options.non_negative;
  auto result = reconstruct::Reconstruct(measurements, how);
  const std::string source = core::Sha256OfFile(options.measurements);
  result.coefficients.provenance["measurements_sha256"] = source;
  result.coefficients.provenance["non_negative"] = options.non_negative ? "yes" : "no";
  lightfield::WriteLightField(options.output, result.coefficients);
  if (!options.sigma.empty()) {
    result.sigma.provenance["sigma_of"] = source;
    lightfield::WriteLightField(options.sigma, result.sigma);
  }
  const auto& report = result.report;
  fmt::print("{}: {} coefficient images\n", options.output, report.images);
  if (report.condition)
    fmt::print(
        "  condition number      {:.4g}; white noise times {:.3g}, worst mode times {:.3g} (units "
        "of 1/h^2)\n",
        *report.condition, *report.noise_gain, *report.worst_gain);
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
        "  incomplete texels     {} of which {} with nothing known: smallest-norm solution, see "
        "--json\n",
        report.incomplete.incomplete, report.incomplete.unknown);
  return reconstruct::ToJson(report);
}

}  // namespace

void AddReconstruct(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "reconstruct", "Solve measurements for the coefficient images of the light field",
      [options] { return Run(*options); });
  verb.add_option("MEASUREMENTS", options->measurements, "The .meas.exr of `luxfield merge`")
      ->required();
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")->required();
  verb.add_option("--sigma", options->sigma,
                  "Write the standard deviation of C as a light field too (.lf.exr)");
  verb.add_flag("--non-negative", options->non_negative,
                "Solve with C >= 0, as the sampling estimators need");
  verb.add_flag("--double", options->double_precision,
                "Sweep in double precision instead of float");
}

}  // namespace luxfield::cli
