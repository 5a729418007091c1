// luxfield filter print -o NAME; measure SESSION -o X.filter.exr; photograph LAB -o NAME
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "luxfield/capture/filter/print_filter.h"
#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/file.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/planning/filter_photographs.h"
#include "luxfield/reconstruct/calibrate/filter/filter_session.h"
#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"
#include "luxfield/reconstruct/calibrate/filter/photograph.h"

namespace luxfield::cli {
namespace {

using lightfield::FilterKind;
using rig::FilterSheet;

struct PrintVerb {
  std::string name, lab, basis = "bspline2", spacing, tone;
  double basis_a = 0.5, scale = 0, dpi = 1200;
  bool dual = false;
};

FilterSheet SheetOf(const PrintVerb& options) {
  if (!options.lab.empty()) {
    const rig::RigDescription rig = hal::MakeDevices(options.lab).rig;
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
  if (!options.tone.empty()) how.tone = rig::ReadToneTable(options.tone);
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

struct MeasureVerb {
  std::string session, calibration, sheet, light, output, tone;
  std::vector<std::string> prints;
  bool skip_hashes = false;
};

// Of the session, or of files; `made_of` gets their hashes.
reconstruct::FilterPhotographs PhotographsOf(const MeasureVerb& options,
                                             std::map<std::string, std::string>& made_of) {
  reconstruct::FilterPhotographs photographs;
  if (!options.session.empty()) {
    if (!options.light.empty() || !options.prints.empty())
      throw InputError("filter measure takes SESSION, or --light and --print, not both");
    photographs =
        reconstruct::ReadFilterSession(session::SessionReader(options.session), options.calibration,
                                       !options.skip_hashes, &made_of);
  } else {
    if (options.sheet.empty() || options.light.empty() || options.prints.empty())
      throw InputError("filter measure needs SESSION, or --sheet, --light and --print");
    if (!options.calibration.empty())
      throw InputError("--calibration goes with SESSION: photographs bring their own noise");
    photographs.light = reconstruct::ReadPhotograph(options.light);
    made_of["light_sha256"] = core::Sha256OfFile(options.light);
    for (std::size_t k = 0; k < options.prints.size(); ++k) {
      photographs.prints.push_back(reconstruct::ReadPhotograph(options.prints[k]));
      made_of[fmt::format("print{}_sha256", k)] = core::Sha256OfFile(options.prints[k]);
    }
  }
  if (!options.sheet.empty()) {
    photographs.sheet = rig::ReadFilterSheet(options.sheet);
    made_of["sheet_sha256"] = core::Sha256OfFile(options.sheet);
  }
  return photographs;
}

core::Json RunMeasure(const MeasureVerb& options) {
  RequireExtension(options.output, ".filter.exr", "--output");
  if (!options.tone.empty()) RequireExtension(options.tone, ".tone.toml", "--tone");
  std::map<std::string, std::string> made_of;
  const auto photographs = PhotographsOf(options, made_of);
  reconstruct::FilterReadings readings;
  auto filter = reconstruct::MeasureFilter(photographs.sheet, photographs.light, photographs.prints,
                                           &readings);
  filter.provenance.insert(made_of.begin(), made_of.end());
  lightfield::WriteMeasuredFilter(options.output, filter);
  if (!options.tone.empty()) rig::WriteToneTable(options.tone, readings.Tone());
  fmt::print("{}: {} x {} texels of {:.4g} mm\n", options.output, filter.lattice.width,
             filter.lattice.height, 1e3 * filter.lattice.ds_m);
  fmt::print("  holder                holes {:.3g} um rms from their places; pixels of {:.4g} mm\n",
             1e6 * readings.holder_residual_m, 1e3 * readings.pixel_m);
  for (std::size_t k = 0; k < readings.prints.size(); ++k) {
    const auto& print = readings.prints[k];
    fmt::print(
        "  print {}               off by ({:.4g}, {:.4g}) um +- {:.2g}, turned by {:.4g} mrad +- "
        "{:.2g}; light {:.5f} of the bare one's\n",
        k + 1, 1e6 * print.shift_m.x, 1e6 * print.shift_m.y, 1e6 * print.shift_sigma_m,
        1e3 * print.rotation_rad, 1e3 * print.rotation_sigma_rad, print.light_ratio);
    if (!print.wedge.empty())
      fmt::print("  wedge                 {} steps, density {:.4f} to {:.3f}\n", print.wedge.size(),
                 print.wedge.front().density, print.wedge.back().density);
  }
  return reconstruct::ToJson(readings);
}

struct PhotographVerb {
  std::string lab, name;
  int pixels = 1024;
};

core::Json RunPhotograph(const PhotographVerb& options, std::optional<std::uint64_t> seed) {
  const auto photographs = planning::PhotographFilter(options.lab, seed, options.pixels);
  core::Json files = core::Json::array();
  const auto write = [&](const std::string& ending, const auto& write_file) {
    const std::string file = options.name + ending;
    write_file(file);
    fmt::print("{}\n", file);
    files.push_back(file);
  };
  write(".sheet.json", [&](const auto& file) { rig::WriteFilterSheet(file, photographs.sheet); });
  write(".light.exr",
        [&](const auto& file) { reconstruct::WritePhotograph(file, photographs.light); });
  const bool dual = photographs.prints.size() == 2;
  for (std::size_t k = 0; k < photographs.prints.size(); ++k)
    write(!dual ? ".print.exr" : (k == 0 ? ".plus.exr" : ".minus.exr"),
          [&](const auto& file) { reconstruct::WritePhotograph(file, photographs.prints[k]); });
  return {{"files", files}};
}

void AddMeasure(Program& program, CLI::App& group) {
  auto options = std::make_shared<MeasureVerb>();
  CLI::App& verb = program.AddVerb(
      group, "measure",
      "Turn photographs of a printed filter, taken without the luminaire, into its transmittance",
      [options] { return RunMeasure(*options); });
  verb.add_option(
          "SESSION", options->session,
          "The session folder (plan of kind \"filter\"); without it --sheet, --light, --print")
      ->check(InputFile({core::FileKind::kFilterSession, core::FileKind::kSession}));
  verb.add_option("--calibration", options->calibration,
                  "The sensor's .cal.json, for the noise of SESSION; without it the session's")
      ->check(InputFile({core::FileKind::kSensorCalibration}));
  verb.add_flag("--skip-hashes", options->skip_hashes,
                "Do not check every frame of SESSION against the journal's SHA-256");
  verb.add_option("--sheet", options->sheet,
                  "The .sheet.json of `luxfield filter print`; with SESSION in place of its own")
      ->check(InputFile({core::FileKind::kFilterSheet}));
  verb.add_option("--light", options->light, "Photograph of the holder without the print (.exr)")
      ->check(InputFile({core::FileKind::kExrPicture}));
  verb.add_option("--print", options->prints,
                  "Photograph with the print (.exr); of a dual pair the plus and the minus part")
      ->check(InputFile({core::FileKind::kExrPicture}));
  verb.add_option("-o,--output", options->output, "The .filter.exr to write")
      ->required()
      ->check(OutputFile());
  verb.add_option("--tone", options->tone,
                  "Also write the printer's .tone.toml, from the step wedge of the first print")
      ->check(OutputFile());
}

void AddPhotograph(Program& program, CLI::App& group) {
  auto options = std::make_shared<PhotographVerb>();
  CLI::App& verb = program.AddVerb(
      group, "photograph",
      "Photograph the filter of a simulated lab on its bench, with the lab's print errors and "
      "noise",
      [options, &program] { return RunPhotograph(*options, program.common().seed); });
  verb.add_option("LAB", options->lab, "The lab.toml")
      ->required()
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option("-o,--output", options->name,
                  "NAME of NAME.sheet.json, NAME.light.exr and NAME.print.exr (or .plus, .minus)")
      ->required()
      ->check(OutputName(".sheet.json"));
  verb.add_option("--pixels", options->pixels, "Side of the photographs")
      ->check(CLI::Range(64, 8192));
}

}  // namespace

void AddFilter(Program& program) {
  CLI::App& group = program.AddGroup(VerbNamed("filter"));
  auto print = std::make_shared<PrintVerb>();
  CLI::App& verb = program.AddVerb(
      group, "print",
      "Write the filter of a basis, or both halves of its dual pair, as 16-bit TIFF and PDF with "
      "registration marks and a step wedge",
      [print] { return RunPrint(*print); });
  verb.add_option("-o,--output", print->name,
                  "NAME of NAME.tif (or NAME.plus.tif, NAME.minus.tif), NAME.pdf, NAME.sheet.json")
      ->required()
      ->check(OutputName(".sheet.json"));
  verb.add_option("--lab", print->lab, "Take basis, spacing, scale and kind from this lab.toml")
      ->check(InputFile({core::FileKind::kLab}));
  verb.add_option("--basis", print->basis, "box, bilinear, quadratic or bspline2");
  verb.add_option("--basis-a", print->basis_a, "Shape of quadratic");
  verb.add_option("--spacing", print->spacing, "Knot spacing, such as 16.5mm");
  verb.add_option("--scale", print->scale,
                  "Transmittance over Phi; 0: as much as a print can hold, 1 / peak");
  verb.add_flag("--dual", print->dual, "The two prints of the dual basis");
  verb.add_option("--dpi", print->dpi, "Resolution of the printer, pixels per inch");
  verb.add_option("--tone", print->tone,
                  "The printer's .tone.toml (default: codes print as they are)");
  AddMeasure(program, group);
  AddPhotograph(program, group);
}

}  // namespace luxfield::cli
