// luxfield preprocess X.lf.exr -o X.tab.exr
#include <fmt/format.h>

#include <memory>

#include "cli/program.h"
#include "core/file.h"
#include "preprocess/table_io.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string light_field, output;
};

core::Json Run(const Options& options) {
  RequireExtension(options.output, ".tab.exr", "--output");
  const auto field = lightfield::ReadLightField(options.light_field);
  const auto tables =
      preprocess::BuildTables(field, options.light_field, core::Sha256OfFile(options.light_field));
  preprocess::WriteTables(options.output, tables);
  int dark = 0;
  for (int m = 0; m < tables.count(); ++m) dark += tables.Total(m) == 0;
  const auto bytes = std::filesystem::file_size(options.output);
  fmt::print("{}: {} summed-area tables of {} x {} texels, {}{}\n", options.output, tables.count(),
             tables.width, tables.height, FormatBytes(double(bytes)),
             dark ? fmt::format("; {} images are all zero", dark) : "");
  return {{"images", tables.count()}, {"all_zero_images", dark}, {"bytes", bytes}};
}

}  // namespace

void AddPreprocess(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("preprocess", "Build the sampling tables of a light field",
                                   [options] { return Run(*options); });
  verb.add_option("LIGHT_FIELD", options->light_field, "The .lf.exr; its coefficients must be >= 0")
      ->required();
  verb.add_option("-o,--output", options->output, "The .tab.exr to write")->required();
}

}  // namespace luxfield::cli
