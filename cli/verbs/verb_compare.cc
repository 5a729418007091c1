// luxfield compare A.exr B.exr: how far A is from the reference B.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/environment/environment_compare.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/film/film.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string a, b, difference;
  int face_size = 0;  // environment maps; 0: pictures or light fields
};

bool IsLightField(const std::string& path) { return path.ends_with(".lf.exr"); }

// All coefficient images below one another, so that light fields compare as pictures do.
core::Image Stack(const std::string& path) {
  const lightfield::LightField field = lightfield::ReadLightField(path);
  const auto& g = field.geometry;
  core::Image image(g.lattice.width, g.lattice.height * g.grid.count(), g.channels);
  for (int channel = 0; channel < g.channels; ++channel)
    for (int m = 0; m < g.grid.count(); ++m) {
      const auto source = field.image(m, channel);
      std::copy(source.begin(), source.end(),
                image.plane(channel).begin() + std::ptrdiff_t(g.plane_size()) * m);
    }
  return image;
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

core::Json Compare(const Options& options) {
  if (options.face_size > 0) return CompareMaps(options);
  if (IsLightField(options.a) != IsLightField(options.b))
    throw InputError(
        fmt::format("{} and {} are of different kinds; compare two light fields or two pictures",
                    options.a, options.b));
  const core::Image a = IsLightField(options.a) ? Stack(options.a) : core::ReadExrImage(options.a);
  const core::Image b = IsLightField(options.b) ? Stack(options.b) : core::ReadExrImage(options.b);
  const core::Difference difference = core::Compare(a, b);
  fmt::print("{} against {} (reference)\n", options.a, options.b);
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
}

}  // namespace luxfield::cli
