// luxfield simulate LAB --plan PLAN -o truth.lf.exr
#include <fmt/format.h>

#include <memory>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/colour.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string lab, plan, output;
  bool non_negative = false;
};

// Every channel of every texel onto C >= 0, keeping its flux.
reconstruct::NonNegativeSummary MakeNonNegative(lightfield::LightField& field) {
  const reconstruct::GramSolver solver(field.geometry.grid);
  std::vector<float*> images;
  for (int m = 0; m < field.geometry.grid.count(); ++m) images.push_back(field.image(m, 0).data());
  return reconstruct::ProjectNonNegative(solver, images.data(),
                                         field.geometry.plane_size() * field.geometry.channels);
}

core::Json Run(const Options& options, std::optional<std::uint64_t> seed) {
  RequireExtension(options.output, ".lf.exr", "--output");
  const capture::Plan plan = capture::ReadPlan(options.plan);
  const hal::sim::SimulatedLab lab(options.lab, seed);
  auto truth = lab.truth(plan.geometry);
  truth.provenance["simulated_truth_of"] = std::filesystem::path(options.lab).filename().string();
  if (options.non_negative) {
    const auto summary = MakeNonNegative(truth);
    truth.provenance["non_negative"] = "yes";
    fmt::print("  non-negative solve    {} pixels, {} iterations at most, {} above the tolerance\n",
               summary.pixels, summary.iterations, summary.unconverged);
  }
  lightfield::WriteLightField(options.output, truth);
  const auto flux = lightfield::TotalFlux(truth);
  fmt::print("{}: the lamp of {} as {} x {} true coefficient images, flux {:.6g} {}\n",
             options.output, options.lab, plan.geometry.grid.width, plan.geometry.grid.height,
             core::Luminance(flux), lightfield::FluxUnitName(plan.geometry.unit));
  return {{"flux", flux},
          {"luminance_flux", core::Luminance(flux)},
          {"images", plan.geometry.grid.count()}};
}

}  // namespace

void AddSimulate(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "simulate", [options, &program] { return Run(*options, program.common().seed); });
  verb.add_option("LAB", options->lab, "The lab.toml of a simulated lab")
      ->required()
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option("--plan", options->plan, "The plan.toml whose planes, basis and lattice to use")
      ->required()
      ->check(InputFile({core::FileKind::kPlan}));
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_flag("--non-negative", options->non_negative,
                "The nearest light field with C >= 0 and the same flux");
}

}  // namespace luxfield::cli
