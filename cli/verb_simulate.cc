// luxfield simulate LAB --plan PLAN -o truth.lf.exr
#include <fmt/format.h>

#include <memory>

#include "capture/plan.h"
#include "cli/program.h"
#include "hal/sim/simulated_lab.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string lab, plan, output;
};

core::Json Run(const Options& options, std::optional<std::uint64_t> seed) {
  RequireExtension(options.output, ".lf.exr", "--output");
  const capture::Plan plan = capture::ReadPlan(options.plan);
  const hal::sim::SimulatedLab lab(options.lab, seed);
  auto truth = lab.truth(plan.geometry);
  truth.provenance["simulated_truth_of"] = std::filesystem::path(options.lab).filename().string();
  lightfield::WriteLightField(options.output, truth);
  const auto flux = lightfield::TotalFlux(truth);
  fmt::print("{}: the lamp of {} as {} x {} true coefficient images, flux {:.6g} {}\n",
             options.output, options.lab, plan.geometry.grid.width, plan.geometry.grid.height,
             flux[0], lightfield::FluxUnitName(plan.geometry.unit));
  return {{"flux", flux}, {"images", plan.geometry.grid.count()}};
}

}  // namespace

void AddSimulate(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "simulate", "Write the true light field of a simulated lab, to judge a measurement by",
      [options, &program] { return Run(*options, program.common().seed); });
  verb.add_option("LAB", options->lab, "The lab.toml of a simulated lab")->required();
  verb.add_option("--plan", options->plan, "The plan.toml whose planes, basis and lattice to use")
      ->required();
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")->required();
}

}  // namespace luxfield::cli
