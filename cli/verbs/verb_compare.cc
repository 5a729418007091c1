// luxfield compare A.exr B.exr: how far A is from the reference B.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <tuple>
#include <vector>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/compare_lamps.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/measures.h"
#include "luxfield/environment/environment_compare.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/render/film/film.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string a, b, difference, output;
  LampsToCompare lamps;  // but for its files
  int face_size = 0;     // environment maps; 0: pictures or light fields
};

bool IsLightField(const std::string& path) { return path.ends_with(".lf.exr"); }

// All coefficient images of all fields below one another, so that light fields compare as pictures do.
core::Image Stack(const std::vector<lightfield::PosedLightField>& fields) {
  const auto& first = fields[0].field.geometry;
  int images = 0;
  for (const auto& posed : fields) images += posed.field.geometry.grid.count();
  core::Image image(first.lattice.width, first.lattice.height * images, first.channels);
  for (int channel = 0; channel < first.channels; ++channel) {
    auto to = image.plane(channel).begin();
    for (const auto& posed : fields)
      for (int m = 0; m < posed.field.geometry.grid.count(); ++m)
        to = std::ranges::copy(posed.field.image(m, channel), to).out;
  }
  return image;
}

// Of one size, so that every coefficient has its like.
bool AreAlike(const std::vector<lightfield::PosedLightField>& a,
              const std::vector<lightfield::PosedLightField>& b) {
  const auto size = [](const lightfield::PosedLightField& posed) {
    const auto& g = posed.field.geometry;
    return std::array{g.lattice.width, g.lattice.height, g.channels};
  };
  return std::ranges::equal(a, b, [&](const auto& x, const auto& y) {
    return size(x) == size(y) && size(x) == size(a[0]) &&
           x.field.geometry.grid.count() == y.field.geometry.grid.count();
  });
}

core::Json CompareMaps(const Options& options) {
  if (!options.difference.empty())
    throw InputError("--difference is of pictures; drop it or --environment");
  const auto map = [&](const std::string& path) {
    return MakeCubeMap(environment::ReadEnvironmentPicture(path), options.face_size);
  };
  const auto difference = environment::CompareEnvironments(map(options.a), map(options.b));
  fmt::print("{} against {} (reference), as cube maps of 6 x {} x {}\n", options.a, options.b,
             options.face_size, options.face_size);
  fmt::print("  relative        {:.6g}   (integral of |a-b| over that of b)\n",
             difference.relative);
  if (difference.turned)
    fmt::print(
        "  turned          {:.6g}   (the least of a turned or mirrored, as b is not itself)\n",
        *difference.turned);
  fmt::print("  mean radiance   {:.6g}   (largest over the channels)\n", difference.mean);
  fmt::print("  irradiance      {:.6g}   (largest of 24 orientations, over the mean)\n",
             difference.irradiance);
  core::Json json{{"relative", difference.relative},
                  {"mean", difference.mean},
                  {"irradiance", difference.irradiance}};
  if (difference.turned) json["turned"] = *difference.turned;
  return json;
}

core::Json ComparePictures(const core::Image& a, const core::Image& b, const Options& options) {
  const core::Difference difference = core::Compare(a, b);
  fmt::print("  relative RMSE   {:.6g}   (RMSE / mean of the reference)\n", difference.rel_rmse);
  fmt::print("  relMSE          {:.6g}\n", difference.rel_mse);
  fmt::print("  bias            {:+.6g}   (mean difference / mean of the reference)\n",
             difference.bias);
  fmt::print("  largest |a-b|   {:.6g}\n", difference.max_abs);
  fmt::print("  mean Lab        {:.4f}   (CIE 1976, exponential operator, k = 1)\n",
             difference.mean_lab);
  if (!options.difference.empty()) {
    if (options.difference.ends_with(".png")) {
      render::WriteFalseColour(options.difference, core::LabDifference(a, b), "CIE 1976", "Lab");
    } else {
      RequireExtension(options.difference, ".exr", "--difference");
      core::Image signed_difference = a;
      for (std::size_t i = 0; i < a.data.size(); ++i) signed_difference.data[i] -= b.data[i];
      core::WriteExrImage(options.difference, signed_difference);
    }
  }
  return {{"rel_rmse", difference.rel_rmse}, {"rel_mse", difference.rel_mse},
          {"bias", difference.bias},         {"max_abs", difference.max_abs},
          {"mean_lab", difference.mean_lab}, {"mean_reference", difference.mean_reference}};
}

// Their coefficients where they are of one geometry, and what they shine in any case.
core::Json CompareLightFields(const Options& options) {
  if (!options.output.empty()) RequireExtension(options.output, ".html", "--output");
  const auto a = lightfield::ReadLightFields(options.a), b = lightfield::ReadLightFields(options.b);
  core::Json json = core::Json::object();
  if (AreAlike(a, b)) {
    json = ComparePictures(Stack(a), Stack(b), options);
  } else {
    if (!options.difference.empty())
      throw InputError(fmt::format(
          "--difference = {}: {} and {} are of different sizes, whose coefficients have no "
          "difference; use --output X.html",
          options.difference, options.a, options.b));
    fmt::print("  of different sizes: their coefficients are not compared\n");
  }
  if (a[0].field.geometry.unit != b[0].field.geometry.unit) {
    if (!options.output.empty())
      throw InputError(
          fmt::format("--output = {}: {} and {} are in different units of flux; compare "
                      "lamps of one",
                      options.output, options.a, options.b));
    fmt::print("  in different units of flux: their photometry is not compared\n");
    json["photometry"] = nullptr;
    return json;
  }
  LampsToCompare lamps = options.lamps;
  lamps.a = options.a;
  lamps.b = options.b;
  const ComparisonReport report = CompareLamps(lamps);
  PrintComparison(report);
  json["photometry"] = ComparisonJson(report);
  if (!options.output.empty()) {
    core::WriteFileAtomically(options.output, ComparisonPage(report));
    fmt::print("wrote {}\n", options.output);
  }
  return json;
}

core::Json Compare(const Options& options) {
  if (options.face_size > 0) return CompareMaps(options);
  const bool lamps = IsLightField(options.a);
  if (lamps != IsLightField(options.b))
    throw InputError(
        fmt::format("{} and {} are of different kinds; compare two light fields or two pictures",
                    options.a, options.b));
  if (!lamps && !(options.output + options.lamps.sigma_a + options.lamps.sigma_b).empty())
    throw InputError("--output, --sigma-a and --sigma-b are of light fields; drop them");
  fmt::print("{} against {} (reference)\n", options.a, options.b);
  if (lamps) return CompareLightFields(options);
  return ComparePictures(core::ReadExrImage(options.a), core::ReadExrImage(options.b), options);
}

}  // namespace

void AddCompare(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb("compare", [options] { return Compare(*options); });
  verb.add_option("A", options->a, "EXR picture or .lf.exr")->required();
  verb.add_option("B", options->b, "The reference, of the same kind and size")->required();
  verb.add_option("--environment", options->face_size,
                  "Both are environment maps, of any layouts: compare them as cube maps of so many "
                  "texels along a face")
      ->check(CLI::Range(1, 8192));
  verb.add_option(
          "-d,--difference", options->difference,
          "Write the difference picture: .exr holds A - B, .png the Lab difference in false colour")
      ->check(OutputFile());
  verb.add_option("-o,--output", options->output,
                  "Of light fields: a .html page with their photometry, and maps of what differs")
      ->check(OutputFile());
  for (const auto& [name, file, which] : {std::tuple{"--sigma-a", &options->lamps.sigma_a, "A"},
                                          {"--sigma-b", &options->lamps.sigma_b, "B"}})
    verb.add_option(name, *file,
                    fmt::format("The standard deviations of {} that `luxfield reconstruct --sigma` "
                                "wrote: differences in units of their uncertainty",
                                which))
        ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("--distance", options->lamps.distance_m,
                  "Of light fields: metres from B to the plane whose illuminance is compared")
      ->capture_default_str()
      ->check(CLI::Range(0.001, 1e4));
}

}  // namespace luxfield::cli
