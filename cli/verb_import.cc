// luxfield import FILE -o X.lf.exr
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "cli/program.h"
#include "core/file.h"
#include "reconstruct/import_rays.h"
#include "scene/transform.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string rays, output, sigma, basis = "bspline2";
  std::vector<double> translation_mm{0, 0, 0}, rotation_deg{0, 0, 0};
  std::vector<int> grid{11, 9}, lattice{128, 128};
  std::optional<double> filter_z_m, delta_m;
  double coverage = 0.9;
  bool non_negative = false;
};

reconstruct::LuminaireFromFile PoseOf(const Options& options) {
  const auto rotation = scene::RotationXyz(
      {options.rotation_deg[0], options.rotation_deg[1], options.rotation_deg[2]});
  reconstruct::LuminaireFromFile pose;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose.rotation[row * 3 + column] = rotation.linear[row][column];
  pose.translation_m = {1e-3 * options.translation_mm[0], 1e-3 * options.translation_mm[1],
                        1e-3 * options.translation_mm[2]};
  return pose;
}

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".lf.exr", "--output");
  if (!options.sigma.empty()) RequireExtension(options.sigma, ".lf.exr", "--sigma");
  const auto file = lightfield::ReadTm25(options.rays);
  reconstruct::ImportRaysOptions how;
  how.luminaire_from_file = PoseOf(options);
  how.basis = lightfield::Basis::FromName(options.basis);
  how.grid_width = options.grid[0];
  how.grid_height = options.grid[1];
  how.lattice_width = options.lattice[0];
  how.lattice_height = options.lattice[1];
  how.filter_z_m = options.filter_z_m;
  how.delta_m = options.delta_m;
  how.coverage = options.coverage;
  how.non_negative = options.non_negative;
  auto result = reconstruct::ImportRays(file, how);
  result.coefficients.provenance["rays_sha256"] = core::Sha256OfFile(options.rays);
  lightfield::WriteLightField(options.output, result.coefficients);
  if (!options.sigma.empty()) lightfield::WriteLightField(options.sigma, result.sigma);

  const auto& r = result.report;
  const auto& g = result.coefficients.geometry;
  const auto unit = lightfield::FluxUnitName(g.unit);
  fmt::print(
      "{}: {} x {} images of {} x {} texels, F at z = {:.5g} mm of the posed file, delta {:.5g} "
      "mm, spacing {:.4g} mm\n",
      options.output, g.grid.width, g.grid.height, g.lattice.width, g.lattice.height,
      1e3 * r.filter_z_m, 1e3 * g.delta_m, 1e3 * g.grid.spacing_m);
  fmt::print("  flux of the header    {}; of the rays {:.8g} {}; rays scaled by {:.8g}\n",
             r.header_flux ? fmt::format("{:.8g} {}", *r.header_flux, unit) : "unknown", r.ray_flux,
             unit, r.scale);
  const auto row = [&](const char* what, const reconstruct::RayTally& tally) {
    fmt::print("  {:<21} {:>10} rays {:>12.6g} {} ({:.3f} %)\n", what, tally.rays, tally.flux, unit,
               r.all.flux > 0 ? 100 * tally.flux / r.all.flux : 0.0);
  };
  row("all", r.all);
  row("go backward", r.backward);
  row("miss the window on F", r.missed_filter_plane);
  row("miss the window on I", r.missed_image_plane);
  row("used", r.used);
  fmt::print("  light field's flux    {:.8g} {} ({:+.4f} % of the rays used)\n", r.fitted_flux,
             unit, r.used.flux > 0 ? 100 * (r.fitted_flux / r.used.flux - 1) : 0.0);
  fmt::print("  negative energy       {:.3g} % of the positive{}\n", 100 * r.negative_energy,
             options.non_negative ? ", before the non-negative solve removed it" : "");
  return reconstruct::ToJson(r);
}

}  // namespace

void AddImport(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("import", "Turn a TM-25 ray file into a light field",
                                   [options] { return Run(*options); });
  verb.add_option("FILE", options->rays, "The .tm25ray file")->required();
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")->required();
  verb.add_option("--sigma", options->sigma,
                  "Write the counting noise of C as a light field too (.lf.exr)");
  verb.add_option("--translate", options->translation_mm,
                  "Pose: shift of the file's frame, mm, after the rotation")
      ->expected(3);
  verb.add_option("--rotate", options->rotation_deg,
                  "Pose: turns about x, then y, then z, degrees; light must go to +z")
      ->expected(3);
  verb.add_option("--filter-z", options->filter_z_m,
                  "z of plane F in the posed frame, m (default: where the beam is narrowest)");
  verb.add_option("--delta", options->delta_m,
                  "Distance from F to I, m (default: twice the light's extent on F)");
  verb.add_option("--basis", options->basis, "Basis on F")
      ->check(CLI::IsMember({"box", "bilinear", "quadratic", "bspline2"}));
  verb.add_option("--grid", options->grid, "Basis functions along u and v")
      ->expected(2)
      ->check(CLI::Range(1, 64));
  verb.add_option("--lattice", options->lattice, "Texels of an image")
      ->expected(2)
      ->check(CLI::Range(1, 4096));
  verb.add_option("--coverage", options->coverage,
                  "Share of the forward flux that both windows must catch")
      ->check(CLI::Range(0.01, 1.0));
  verb.add_flag("--non-negative", options->non_negative,
                "Solve with C >= 0, as the sampling estimators need");
}

}  // namespace luxfield::cli
