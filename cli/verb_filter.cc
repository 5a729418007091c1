// luxfield filter print -o NAME
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "capture/print_filter.h"
#include "cli/program.h"
#include "hal/devices.h"

namespace luxfield::cli {
namespace {

using lightfield::FilterKind;
using lightfield::FilterSheet;

struct PrintVerb {
  std::string name, lab, basis = "bspline2", spacing, tone;
  double basis_a = 0.5, scale = 0, dpi = 1200;
  bool dual = false;
};

FilterSheet SheetOf(const PrintVerb& options) {
  if (!options.lab.empty()) {
    const hal::RigDescription rig = hal::MakeDevices(options.lab).rig;
    return FilterSheet::Make(rig.dual ? FilterKind::kDual : FilterKind::kBasis, rig.basis,
                             rig.spacing_m, rig.filter_scale);
  }
  if (options.spacing.empty())
    throw InputError("filter print needs the filter: give --spacing and --basis, or --lab");
  const auto basis = lightfield::Basis::FromName(options.basis, options.basis_a);
  const double full = 1 / std::pow(basis.Peak(), 2);
  return FilterSheet::Make(options.dual ? FilterKind::kDual : FilterKind::kBasis, basis,
                           ParseQuantity(options.spacing, "--spacing", {{"mm", 1e-3}, {"m", 1}}),
                           options.dual ? 1 : (options.scale > 0 ? options.scale : full));
}

core::Json RunPrint(const PrintVerb& options) {
  const FilterSheet sheet = SheetOf(options);
  capture::PrintOptions how;
  how.dpi = options.dpi;
  if (!options.tone.empty()) how.tone = lightfield::ReadToneTable(options.tone);
  const auto files = capture::PrintFilter(sheet, options.name, how);
  fmt::print("{} filter, spacing {:.6g} mm, scale {:.6g}: sheet of {:.6g} mm at {:.6g} dpi\n",
             sheet.basis.name(), 1e3 * sheet.spacing_m, sheet.filter_scale, 2e3 * sheet.half_m,
             how.dpi);
  core::Json names = core::Json::array();
  for (const auto& file : files) {
    fmt::print("  {}\n", file.string());
    names.push_back(file.string());
  }
  return {{"files", names}, {"dpi", how.dpi}, {"side_m", 2 * sheet.half_m}};
}

}  // namespace

void AddFilter(Program& program) {
  CLI::App& group = program.AddGroup("filter", "Print optical filters");
  auto print = std::make_shared<PrintVerb>();
  CLI::App& verb = program.AddVerb(
      group, "print",
      "Write the filter of a basis, or both halves of its dual pair, as 16-bit TIFF and PDF with "
      "registration marks and a step wedge",
      [print] { return RunPrint(*print); });
  verb.add_option("-o,--output", print->name,
                  "NAME of NAME.tif (or NAME.plus.tif, NAME.minus.tif), NAME.pdf, NAME.sheet.json")
      ->required();
  verb.add_option("--lab", print->lab, "Take basis, spacing, scale and kind from this lab.toml");
  verb.add_option("--basis", print->basis, "box, bilinear, quadratic or bspline2");
  verb.add_option("--basis-a", print->basis_a, "Shape of quadratic");
  verb.add_option("--spacing", print->spacing, "Knot spacing, such as 16.5mm");
  verb.add_option("--scale", print->scale,
                  "Transmittance over Phi; 0: as much as a print can hold, 1 / peak");
  verb.add_flag("--dual", print->dual, "The two prints of the dual basis");
  verb.add_option("--dpi", print->dpi, "Resolution of the printer, pixels per inch");
  verb.add_option("--tone", print->tone,
                  "The printer's .tone.toml (default: codes print as they are)");
}

}  // namespace luxfield::cli
