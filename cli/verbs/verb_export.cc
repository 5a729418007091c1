// luxfield export X.lf.exr -o NAME.ENDING
#include "luxfield/cli/verbs/verb_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "luxfield/cli/named_files.h"
#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"

namespace luxfield::cli {
namespace {

using Kind = ExportFormat::Kind;

const std::vector<ExportFormat>& Formats() {
  static const std::vector<ExportFormat> formats = {
      {"tm25", Kind::kRays, {".tm25ray"}, formats::RayFormat::kTm25},
      {"zemax", Kind::kRays, {".dat", ".sdf", ".ray"}, formats::RayFormat::kZemax},
      {"lighttools", Kind::kRays, {".ltrf", ".ray"}, formats::RayFormat::kLightTools},
      {"lighttools-text",
       Kind::kRays,
       {".ltrf", ".txt", ".ray"},
       formats::RayFormat::kLightToolsText},
      {"speos", Kind::kRays, {".speos.ray", ".ray"}, formats::RayFormat::kSpeos},
      {"lm-63-2002", Kind::kIntensities, {".ies"}},
      {"lm-63-2019", Kind::kIntensities, {".ies"}},
      {"eulumdat", Kind::kIntensities, {".ldt"}},
      {"tm-33-23", Kind::kIntensities, {".tm33.xml", ".xml"}},
      {"gldf", Kind::kIntensities, {".gldf"}},
      {"hdr", Kind::kPicture, {".hdr"}},
      {"exr", Kind::kPicture, {".exr"}},
      {"html", Kind::kPage, {".html"}},
      {"radiance", Kind::kBridge, {".rad"}},
      {"mitsuba", Kind::kBridge, {".xml"}},
      {"blender", Kind::kBridge, {".json"}},
      {"gltf", Kind::kBridge, {".glb"}},
      {"usd", Kind::kBridge, {".usda"}},
      {"pbrt", Kind::kBridge, {".pbrt"}},
  };
  return formats;
}

bool EndsIn(const std::string& output, const ExportFormat& format) {
  return std::any_of(format.endings.begin(), format.endings.end(),
                     [&](std::string_view ending) { return output.ends_with(ending); });
}

std::string Endings(const ExportFormat& format) {
  std::string list;
  for (const auto ending : format.endings)
    list += (list.empty()                      ? ""
             : ending == format.endings.back() ? " or "
                                               : ", ") +
            std::string(ending);
  return list;
}

std::string AllEndings() {
  std::vector<std::string_view> all;
  for (const ExportFormat& format : Formats())
    for (const auto ending : format.endings)
      if (std::find(all.begin(), all.end(), ending) == all.end()) all.push_back(ending);
  std::string list;
  for (const auto ending : all) list += (list.empty() ? "" : ", ") + std::string(ending);
  return list;
}

// Endings that several programs give their files.
bool IsOfSeveral(const std::string& output) {
  return (output.ends_with(".ray") && !output.ends_with(".speos.ray")) || output.ends_with(".txt");
}

// By --format, else the first of the list that has the output's ending.
const ExportFormat& FormatOf(const ExportOptions& options) {
  const std::string& output = options.output;
  for (const ExportFormat& format : Formats())
    if (options.format.empty() && output.ends_with(format.endings.front())) return format;
  for (const ExportFormat& format : Formats()) {
    if (options.format.empty() && EndsIn(output, format) && !IsOfSeveral(output)) return format;
    if (options.format != format.name) continue;
    if (!EndsIn(output, format))
      throw InputError(output, fmt::format("is no name for --format {}", format.name),
                       fmt::format("end it in {}", Endings(format)));
    return format;
  }
  if (IsOfSeveral(output))
    throw InputError(output, "may be of several programs", "name one with --format");
  throw InputError(output, "has an ending that names no format",
                   fmt::format("end it in one of {}", AllEndings()));
}

// Throws InputError where an option is given that the kind of file, or the view, does not read.
void RequireRead(const ExportOptions& options, const ExportFormat& format) {
  const auto require = [&](bool given, bool read, const char* option, const char* of) {
    if (given && !read)
      throw InputError(fmt::format("{} is read for {} and not for {}; drop it", option, of,
                                   core::Printable(options.output)));
  };
  const bool rays = format.kind == Kind::kRays, intensities = format.kind == Kind::kIntensities,
             picture = format.kind == Kind::kPicture;
  const bool plane = picture && options.view == "plane";
  const char *of_intensities = ".ies, .ldt, .tm33.xml and .gldf", *of_pictures = ".hdr and .exr";
  require(options.rays.has_value(), rays, "--rays", "files of rays");
  require(options.distance_m.has_value(), intensities || picture, "--distance",
          "intensities and pictures");
  require(options.plane_step_deg.has_value(), intensities, "--plane-step", of_intensities);
  require(options.angle_step_deg.has_value(), intensities, "--angle-step", of_intensities);
  require(!options.sigma.empty(), intensities, "--sigma", of_intensities);
  require(options.view != "perspective", picture, "--view", of_pictures);
  require(!options.eye.empty(), picture, "--eye", of_pictures);
  require(!options.look_at.empty(), picture, "--look-at", of_pictures);
  require(!options.up.empty(), picture, "--up", of_pictures);
  require(!options.size.empty(), picture, "--size", of_pictures);
  require(!options.extent_m.empty(), plane, "--extent", "--view plane");
  require(options.fov_deg.has_value(),
          picture && (options.view == "perspective" || options.view == "fisheye"), "--fov",
          "--view perspective and fisheye");
  require(options.samples.has_value(), picture && !plane, "--samples", "pictures of the lamp");
  if (!options.eye.empty() && options.distance_m)
    throw InputError("--distance contradicts --eye, which says where the eye is; drop one");
}

core::Json Run(const ExportOptions& options) {
  const ExportFormat& format = FormatOf(options);
  RequireRead(options, format);
  const Fields fields = lightfield::ReadLightFields(options.field);
  switch (format.kind) {
    case Kind::kRays:
      return ExportRays(options, format, fields);
    case Kind::kIntensities:
      return ExportIntensities(options, format, fields);
    case Kind::kPicture:
      return ExportPicture(options, format, fields);
    case Kind::kPage:
      return ExportPage(options, format, fields);
    case Kind::kBridge:
      break;
  }
  return ExportBridge(options, format, fields);
}

std::vector<std::string> FormatNames() {
  std::vector<std::string> names;
  for (const ExportFormat& format : Formats()) names.emplace_back(format.name);
  return names;
}

}  // namespace

std::string UnitOf(const Fields& fields) {
  return lightfield::FluxUnitName(fields.front().field.geometry.unit);
}

core::Json ReportChecks(const ExportOptions& options, const ExportFormat& format,
                        const std::vector<formats::ExportCheck>& checks) {
  core::Json rows = core::Json::array();
  for (const formats::ExportCheck& check : checks) {
    fmt::print("  check        {:.3g} % off the {}, at most ({:.3g} % stated, {} receivers)\n",
               100 * check.max_rel_error, check.judge, 100 * check.stated_error, check.receivers);
    rows.push_back({{"format", format.name},
                    {"judge", check.judge},
                    {"receivers", check.receivers},
                    {"max_rel_error", check.max_rel_error},
                    {"mc_sigma", check.mc_sigma},
                    {"stated_error", check.stated_error}});
    if (!check.holds())
      throw Error(fmt::format("{}: is {:.3g} % off the {}, beyond the {:.3g} % that it may be; it "
                              "is not kept, and this is a bug of luxfield: please report it",
                              options.output, 100 * check.max_rel_error, check.judge,
                              100 * check.stated_error),
                  1);
  }
  return rows;
}

void AddExport(Program& program) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App& verb = program.AddVerb("export", [options, &program] {
    options->seed = program.common().seed.value_or(1);
    return Run(*options);
  });
  verb.add_option("FILE", options->field, "The .lf.exr")
      ->required()
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("-o,--output", options->output, "The file to write: " + AllEndings())
      ->required()
      ->check(OutputFile());
  verb.add_option(
          "--format,--to", options->format,
          "The file's format or the program it is for, where the ending does not say enough "
          "(default: the first that has the ending)")
      ->check(CLI::IsMember(FormatNames()));
  verb.add_option("--rays", options->rays,
                  fmt::format("Rays of equal flux (default: {})", kDefaultRays))
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  verb.add_option("--distance", options->distance_m,
                  "Intensities as a photometer at this distance from the lamp's origin takes them "
                  "(default: the far field); pictures: of the eye on the lamp's axis (default: 1, "
                  "or four times the lamp's reach); m")
      ->check(CLI::Range(1e-3, 1e6));
  verb.add_option("--plane-step", options->plane_step_deg,
                  "Intensities: degrees between planes C (default: as the lamp needs, 5 to 1.25)")
      ->check(CLI::Range(0.1, 90.0));
  verb.add_option("--angle-step", options->angle_step_deg,
                  "Intensities: degrees between angles gamma (default: as the lamp needs, 1 to "
                  "0.25)")
      ->check(CLI::Range(0.05, 45.0));
  verb.add_option("--sigma", options->sigma,
                  "Standard deviations of the light field (.lf.exr): the file then states the "
                  "uncertainty of flux and peak")
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("--view", options->view,
                  "Pictures: the lamp's luminance in perspective, through a fisheye (equal angles) "
                  "or in all directions, or its irradiance on a plane about --eye")
      ->capture_default_str()
      ->check(CLI::IsMember({"perspective", "fisheye", "equirectangular", "plane"}));
  verb.add_option("--eye", options->eye, "Pictures: where the eye is, m")->expected(3);
  verb.add_option("--look-at", options->look_at,
                  "Pictures: what is in the middle, m (default: the lamp's origin)")
      ->expected(3);
  verb.add_option("--up", options->up, "Pictures: direction that points up (default: 0 1 0)")
      ->expected(3);
  verb.add_option("--fov", options->fov_deg,
                  "Pictures: degrees between the upper and the lower edge (default: the whole "
                  "lamp); fisheye: across the shorter side (default: 180)")
      ->check(CLI::Range(0.01, 360.0));
  verb.add_option("--size", options->size, "Pictures: width and height, pixels (default: 512 512)")
      ->expected(2)
      ->check(CLI::Range(1, 16384));
  verb.add_option(
          "--samples", options->samples,
          fmt::format("Pictures: rays along either side of a pixel (default: {})", kDefaultSamples))
      ->check(CLI::Range(1, 64));
  verb.add_option("--extent", options->extent_m,
                  "--view plane: width and height, m (default: twice the distance)")
      ->expected(2)
      ->check(CLI::Range(1e-6, 1e6));
  verb.add_flag("--check", options->check,
                "Read the file back and compare it with the light field in closed form, or have "
                "Radiance, Blender or Mitsuba light with it (docs/bridges.md; minutes)");
}

}  // namespace luxfield::cli
