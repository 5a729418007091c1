// luxfield bench spacing
#include "luxfield/bench/verbs/verb_bench_spacing.h"

#include <fmt/format.h>

#include <memory>

#include "luxfield/bench/bench_spacing.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::bench {
namespace {

// One of the two curves: `vary` is the rows' and `x` the key along the axis.
cli::Plot CurveOf(const core::Json& rows, const std::string& vary, const std::string& x,
                  const std::string& x_label) {
  cli::Plot plot;
  plot.title = "What an ideal measurement leaves of the lamp";
  plot.x_label = x_label;
  plot.y_label = "irradiance: RMSE / RMS, %;  picture: mean Lab";
  plot.log_x = plot.log_y = true;
  cli::Series irradiance, picture;
  irradiance.name = "irradiance without shadows, %";
  picture.name = "picture, mean Lab";
  for (const auto& row : rows) {
    if (row.value("vary", "") != vary) continue;
    for (cli::Series* series : {&irradiance, &picture}) series->x.push_back(row.value(x, 0.0));
    irradiance.y.push_back(100 * row.value("rel_l2", 0.0));
    picture.y.push_back(row.value("mean_lab", 0.0));
  }
  plot.series = {irradiance, picture};
  return plot;
}

core::Json Run(const BenchSpacingOptions& options) {
  const core::Json rows = BenchSpacing(options);
  fmt::print("{:>7} {:>10} {:>8} {:>9} {:>9} {:>9} {:>11} {:>10} {:>9}\n", "vary", "spacing_mm",
             "delta_m", "positions", "texel_mm", "flux", "RMSE/mean", "RMSE/RMS", "mean_lab");
  for (const auto& row : rows)
    fmt::print("{:>7} {:>10.4g} {:>8.3g} {:>9} {:>9.3g} {:>+8.3f}% {:>10.3g}% {:>9.3g}% {:>9.3f}\n",
               row.value("vary", ""), row.value("spacing_mm", 0.0), row.value("delta_m", 0.0),
               row.value("positions", 0), row.value("texel_mm", 0.0),
               100 * row.value("flux_error", 0.0), 100 * row.value("rel_rmse", 0.0),
               100 * row.value("rel_l2", 0.0), row.value("mean_lab", 0.0));
  for (const auto& [vary, x, label] :
       {std::tuple{"spacing", "spacing_mm", "spacing of the filters, mm"},
        std::tuple{"delta", "delta_m", "distance of the planes, m"}}) {
    const auto file = options.folder / fmt::format("{}.svg", vary);
    core::WriteFileAtomically(file, cli::SvgPlot(CurveOf(rows, vary, x, label)));
    fmt::print("{}\n", file.string());
  }
  return {{"rows", rows}};
}

}  // namespace

void AddBenchSpacing(cli::Program& program, CLI::App& benches) {
  auto options = std::make_shared<BenchSpacingOptions>();
  options->folder = "out/spacing";
  CLI::App& verb = program.AddVerb(benches, "spacing",
                                   "What spacing and plane distance leave of a lamp, as curves",
                                   [options, &program] {
                                     options->threads = program.common().threads;
                                     return Run(*options);
                                   });
  verb.add_option("--lab", options->lab, "The simulated lab whose lamp it is");
  verb.add_option("--plan", options->plan, "Its plan: basis, spacing, delta, images");
  verb.add_option("--scene", options->scene, "Whose picture the errors are of");
  verb.add_option("--spacing", options->spacings_mm, "Spacings to try, mm")->default_str("");
  verb.add_option("--delta", options->deltas_m, "Distances of the planes to try, m")
      ->default_str("");
  verb.add_option("--texels", options->texels, "Along each side of the images (0: the plan's)")
      ->check(CLI::Range(0, 4096));
  verb.add_option("--width", options->width, "Picture width, pixels")->check(CLI::Range(1, 16384));
  verb.add_option("--height", options->height, "Picture height, pixels")
      ->check(CLI::Range(1, 16384));
  verb.add_option("--device", options->device, "OpenCL device (default: the first)");
  verb.add_option("--folder", options->folder, "Where curves go, and scratch")
      ->capture_default_str();
}

}  // namespace luxfield::bench
