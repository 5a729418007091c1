// luxfield import FILE -o X.lf.exr
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "luxfield/cli/memory_option.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/file.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/reconstruct/solve/import_rays.h"
#include "luxfield/reconstruct/solve/import_rays_json.h"
#include "luxfield/scene/transform.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string rays, output, sigma, memory, basis = "bspline2", faces = "auto", flux = "auto";
  std::vector<double> translation_mm{0, 0, 0}, rotation_deg{0, 0, 0};
  std::vector<int> grid, lattice;
  std::optional<double> filter_z_m, delta_m, coverage;
  bool non_negative = false, is_signed = false;
};

lightfield::RigidPose PoseOf(const Options& options) {
  const auto rotation = scene::RotationXyz(
      {options.rotation_deg[0], options.rotation_deg[1], options.rotation_deg[2]});
  lightfield::RigidPose pose;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose.rotation[row * 3 + column] = rotation.linear[row][column];
  pose.translation_m = {1e-3 * options.translation_mm[0], 1e-3 * options.translation_mm[1],
                        1e-3 * options.translation_mm[2]};
  return pose;
}

reconstruct::RayDirections DirectionsOf(const std::string& faces) {
  if (faces == "beam") return reconstruct::RayDirections::kBeam;
  if (faces == "one") return reconstruct::RayDirections::kOne;
  if (faces == "cube") return reconstruct::RayDirections::kCube;
  return reconstruct::RayDirections::kAuto;
}

void SetFlux(const std::string& flux, reconstruct::ImportRaysOptions& how) {
  if (flux == "auto") return;
  if (flux == "header") {
    how.flux_from = reconstruct::RayFluxFrom::kHeader;
  } else if (flux == "rays") {
    how.flux_from = reconstruct::RayFluxFrom::kRays;
  } else {
    how.flux_from = reconstruct::RayFluxFrom::kValue;
    how.flux = ParseQuantity(flux, "--flux", {{"", 1}});
  }
}

reconstruct::ImportRaysOptions ImportOptions(const Options& options) {
  if (options.non_negative && options.is_signed)
    throw InputError("--signed contradicts --non-negative; drop one");
  reconstruct::ImportRaysOptions how;
  how.luminaire_from_file = PoseOf(options);
  how.directions = DirectionsOf(options.faces);
  how.planes.basis = lightfield::Basis::FromName(options.basis);
  if (!options.grid.empty()) {
    how.planes.grid_width = options.grid[0];
    how.planes.grid_height = options.grid[1];
  }
  if (!options.lattice.empty()) {
    how.planes.lattice_width = options.lattice[0];
    how.planes.lattice_height = options.lattice[1];
  }
  how.planes.filter_z_m = options.filter_z_m;
  how.planes.delta_m = options.delta_m;
  how.coverage = options.coverage;
  SetFlux(options.flux, how);
  how.sigma = !options.sigma.empty();
  how.memory_bytes = MemoryLeft(options.memory).value_or(0);
  how.signs = options.non_negative ? reconstruct::RaySigns::kNonNegative
              : options.is_signed  ? reconstruct::RaySigns::kSigned
                                   : reconstruct::RaySigns::kAuto;
  return how;
}

void Print(const std::string& output, const reconstruct::RayImport& result) {
  const auto& r = result.report;
  const auto unit = lightfield::FluxUnitName(result.coefficients.front().field.geometry.unit);
  fmt::print("{}: {} light field{}\n", output, r.fields.size(), r.fields.size() == 1 ? "" : "s");
  for (std::size_t k = 0; k < r.fields.size(); ++k) {
    const auto& g = result.coefficients[k].field.geometry;
    fmt::print(
        "  {}  {:>7} rays {:>11.5g} {}  {} x {} images of {} x {} texels, F at {:.5g} mm, delta "
        "{:.5g} mm, spacing {:.4g} mm, {:.3g} % negative\n",
        r.fields[k].name, r.fields[k].used.rays, r.fields[k].used.flux, unit, g.grid.width,
        g.grid.height, g.lattice.width, g.lattice.height, 1e3 * r.fields[k].filter_z_m,
        1e3 * g.delta_m, 1e3 * g.grid.spacing_m, 100 * r.fields[k].negative_energy);
  }
  fmt::print("  flux of the header    {}; of the rays {:.8g} {}; rays scaled by {:.8g}\n",
             r.header_flux ? fmt::format("{:.8g} {}", *r.header_flux, unit) : "unknown", r.ray_flux,
             unit, r.scale);
  const auto row = [&](const char* what, const reconstruct::RayTally& tally) {
    fmt::print("  {:<21} {:>10} rays {:>12.6g} {} ({:.3f} %)\n", what, tally.rays, tally.flux, unit,
               r.all.flux > 0 ? 100 * tally.flux / r.all.flux : 0.0);
  };
  row("all", r.all);
  row("go backward", r.backward);
  row("go beside the beam", r.beside);
  row("miss the window on F", r.missed_filter_plane);
  row("miss the window on I", r.missed_image_plane);
  row("used", r.used);
  fmt::print("  light field's flux    {:.8g} {} ({:+.4f} % of the rays used)\n", r.fitted_flux,
             unit, r.used.flux > 0 ? 100 * (r.fitted_flux / r.used.flux - 1) : 0.0);
  const bool projected = std::any_of(r.fields.begin(), r.fields.end(),
                                     [](const auto& field) { return field.non_negative; });
  fmt::print("  negative energy       {:.3g} % of the positive{}\n", 100 * r.negative_energy,
             projected ? ", before the non-negative solve removed it" : "");
}

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".lf.exr", "--output");
  if (!options.sigma.empty()) RequireExtension(options.sigma, ".lf.exr", "--sigma");
  auto result = reconstruct::ImportRays(
      [&](const formats::RayTaker& take) { return formats::StreamRays(options.rays, take); },
      ImportOptions(options));
  const std::string hash = core::Sha256OfFile(options.rays);
  for (auto& posed : result.coefficients) posed.field.provenance["rays_sha256"] = hash;
  lightfield::WriteLightFields(options.output, result.coefficients);
  if (!options.sigma.empty()) lightfield::WriteLightFields(options.sigma, result.sigma);
  Print(options.output, result);
  auto json = reconstruct::ToJson(result.report);
  for (std::size_t k = 0; k < result.coefficients.size(); ++k) {
    const auto& g = result.coefficients[k].field.geometry;
    json["fields"][k].update({{"grid_width", g.grid.width},
                              {"grid_height", g.grid.height},
                              {"spacing_m", g.grid.spacing_m},
                              {"delta_m", g.delta_m},
                              {"width", g.lattice.width},
                              {"height", g.lattice.height}});
  }
  const auto warnings = reconstruct::Warnings(result);
  for (const auto& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  json["warnings"] = warnings;
  return json;
}

}  // namespace

void AddImport(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("import", [options] { return Run(*options); });
  verb.add_option("FILE", options->rays, "A ray file of TM-25, Zemax, LightTools or Speos")
      ->required()
      ->check(InputFile({core::FileKind::kRays}));
  verb.add_option("-o,--output", options->output, "The .lf.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--sigma", options->sigma,
                  "Write the counting noise of C as a light field too (.lf.exr)")
      ->check(OutputFile());
  verb.add_option("--translate", options->translation_mm,
                  "Pose: shift of the file's frame, mm, after the rotation")
      ->expected(3);
  verb.add_option("--rotate", options->rotation_deg,
                  "Pose: turns about x, then y, then z, degrees; light must go to +z")
      ->expected(3);
  verb.add_option("--filter-z", options->filter_z_m,
                  "z of plane F in the posed frame, m (default: where the beam is narrowest)");
  verb.add_option("--delta", options->delta_m,
                  "Distance from F to I, m (default: as suits the rays)");
  verb.add_option("--basis", options->basis, "Basis on F")
      ->check(CLI::IsMember({"box", "bilinear", "quadratic", "bspline2"}));
  verb.add_option("--faces", options->faces,
                  "beam: one light field of the rays within the pyramid |dx|, |dy| <= dz; one: of "
                  "all rays towards +z; cube: up to six fields, one per face of the cube of "
                  "directions; auto: one field of all rays within |dx|, |dy| <= 2 dz if at most "
                  "1 % of the flux is beyond the beam and 0.01 % beyond that, else cube")
      ->check(CLI::IsMember({"auto", "beam", "one", "cube"}));
  verb.add_option(
      "--flux", options->flux,
      "Flux of all rays, or whose: VALUE in the file's unit, header, rays; auto: the header's if "
      "within a factor of 100 of the rays', else the rays'");
  verb.add_option("--grid", options->grid,
                  "Basis functions along u and v (default: as suits the rays)")
      ->expected(2)
      ->check(CLI::Range(1, 64));
  verb.add_option("--lattice", options->lattice, "Texels of an image (default: as suits the rays)")
      ->expected(2)
      ->check(CLI::Range(1, 4096));
  verb.add_option("--coverage", options->coverage,
                  "Share of a field's flux that its windows must catch (default: 1; 0.99 for "
                  "--faces one with rays beyond |dx|, |dy| <= 2 dz)")
      ->check(CLI::Range(0.01, 1.0));
  verb.add_flag("--non-negative", options->non_negative,
                "Solve with C >= 0, which a ray file's noise asks for (default, unless a channel's "
                "flux is negative)");
  verb.add_flag("--signed", options->is_signed, "Keep the signed least-squares fit");
  AddMemoryOption(verb, options->memory,
                  "rays are never all in memory; light fields that do not fit are refused");
}

}  // namespace luxfield::cli
