// luxfield export X.lf.exr -o NAME.EXT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "luxfield/cli/named_files.h"
#include "luxfield/cli/program.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/file.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/progress.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/preprocess/ray_sampler.h"

namespace luxfield::cli {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

struct Options {
  std::string field, output, format;
  std::uint64_t rays = 1000000;
  std::optional<double> distance_m;
  double plane_step_deg = 5, angle_step_deg = 1;
  bool check = false;
};

// Names of --format, and the endings that stand for them.
struct Format {
  const char* name;
  const char* ending;
  std::optional<formats::RayFormat> rays;
};
constexpr Format kFormats[] = {
    {"tm25", ".tm25ray", formats::RayFormat::kTm25},
    {"zemax", ".dat", formats::RayFormat::kZemax},
    {"zemax", ".sdf", formats::RayFormat::kZemax},
    {"lighttools", ".ltrf", formats::RayFormat::kLightTools},
    {"lighttools-text", ".ltrf.txt", formats::RayFormat::kLightToolsText},
    {"speos", ".speos.ray", formats::RayFormat::kSpeos},
    {"lm-63-2002", ".ies", {}},
    {"lm-63-2019", ".2019.ies", {}},
    {"eulumdat", ".ldt", {}},
};

const Format& FormatOf(const Options& options) {
  const std::string& output = options.output;
  const Format* found = nullptr;
  for (const Format& format : kFormats) {
    if (!options.format.empty() && options.format == format.name) return format;
    // The longest ending that fits: .2019.ies before .ies.
    if (options.format.empty() && output.ends_with(format.ending) &&
        (!found || std::string_view(format.ending).size() > std::string_view(found->ending).size()))
      found = &format;
  }
  if (found) return *found;
  throw InputError(output, "has an ending that names no format",
                   "end it in .tm25ray, .dat, .sdf, .ltrf, .ltrf.txt, .speos.ray, .ies, .2019.ies "
                   "or .ldt, or name one with --format");
}

bool IsLuminous(const std::vector<PosedLightField>& fields) {
  return fields.front().field.geometry.unit != lightfield::FluxUnit::kWatt;
}

// Draws the rays of one file: the same ones for the same seed.
class Rays {
 public:
  Rays(const std::vector<PosedLightField>& fields, const preprocess::RaySampler& sampler,
       std::uint64_t count, std::uint64_t seed)
      : sampler_(sampler),
        count_(count),
        tristimulus_(IsLuminous(fields) && std::all_of(fields.begin(), fields.end(),
                                                       [](const auto& posed) {
                                                         return posed.field.geometry.channels == 3;
                                                       })),
        random_(seed, kStream) {}

  bool tristimulus() const { return tristimulus_; }

  bool Next(formats::Ray& ray) {
    if (done_ == count_) return false;
    if (done_ % 65536 == 0) core::ThrowIfInterrupted();
    ++done_;
    const preprocess::DrawnRay drawn = sampler_.Draw(random_);
    ray = {drawn.position_m, drawn.direction, sampler_.flux() / double(count_), {}};
    if (tristimulus_) {
      const core::Rgb xyz = core::Apply(xyz_, drawn.colour);
      ray.tristimulus = {ray.flux * xyz[0], ray.flux, ray.flux * xyz[2]};
    }
    return true;
  }

 private:
  static constexpr std::uint64_t kStream = 0x7261797365787074;

  const preprocess::RaySampler& sampler_;
  std::uint64_t count_, done_ = 0;
  bool tristimulus_;
  core::Random random_;
  core::Matrix3 xyz_ = core::XyzFromRgb(core::kRec709);
};

core::Json Row(const std::string& format, const char* judge, int receivers, double error,
               double mc_sigma, double stated) {
  fmt::print(
      "  check        {} receivers, error at most {:.3g} % of the largest value; stated "
      "{:.3g} %, of which one standard deviation of counting {:.3g} %\n",
      receivers, 100 * error, 100 * stated, 100 * mc_sigma);
  return {{"format", format},       {"judge", judge},       {"receivers", receivers},
          {"max_rel_error", error}, {"mc_sigma", mc_sigma}, {"stated_error", stated}};
}

// Irradiance on the plane z, facing the lamp.
double IrradianceOnPlane(const std::vector<PosedLightField>& fields, Vec3 p) {
  double sum = 0;
  for (const auto& posed : fields) {
    const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
    const Vec3 q = field_from_luminaire.Point(p);
    if (q.z > 0)
      sum += core::Luminance(
          lightfield::ExactIrradiance(posed.field, q, field_from_luminaire.Direction({0, 0, -1})));
  }
  return sum;
}

// The file read back: the flux of its rays through 8 x 8 patches of a plane in front of the lamp
// beside the integral of the exact irradiance.
core::Json CheckRays(const std::string& path, const std::string& format,
                     const std::vector<PosedLightField>& fields) {
  constexpr int kPatches = 8, kNodes = 6;
  const formats::RayFile file = formats::ReadRays(path);
  double z = 0;
  for (const auto& posed : fields)
    z = std::max(z, posed.luminaire_from_field.translation_m.z + 2 * posed.field.geometry.delta_m);
  std::vector<double> xs, ys;
  std::vector<std::array<double, 3>> hits;  // x, y, flux
  for (const formats::Ray& ray : file.rays) {
    if (!(ray.direction.z > 0)) continue;
    const double way = (z - ray.position_m.z) / ray.direction.z;
    if (!(way > 0)) continue;
    hits.push_back({ray.position_m.x + way * ray.direction.x,
                    ray.position_m.y + way * ray.direction.y, ray.flux});
    xs.push_back(hits.back()[0]);
    ys.push_back(hits.back()[1]);
  }
  if (hits.size() < 1000) throw InputError(path, "has too few rays for --check", "raise --rays");
  const auto middle = [](std::vector<double>& list) {
    std::sort(list.begin(), list.end());
    return std::pair{list[list.size() / 20], list[list.size() - 1 - list.size() / 20]};
  };
  const auto [x0, x1] = middle(xs);
  const auto [y0, y1] = middle(ys);
  const double dx = (x1 - x0) / kPatches, dy = (y1 - y0) / kPatches;
  std::vector<double> found(kPatches * kPatches, 0), exact(found);
  for (const auto& [x, y, flux] : hits) {
    const double column = std::floor((x - x0) / dx), row = std::floor((y - y0) / dy);
    if (column >= 0 && column < kPatches && row >= 0 && row < kPatches)
      found[std::size_t(row) * kPatches + std::size_t(column)] += flux;
  }
  core::Progress progress("check", exact.size());
  for (std::size_t k = 0; k < exact.size(); ++k, progress.Advance())
    for (int a = 0; a < kNodes; ++a)
      for (int b = 0; b < kNodes; ++b)
        exact[k] +=
            dx * dy / (kNodes * kNodes) *
            IrradianceOnPlane(fields, {x0 + (double(k % kPatches) + (a + 0.5) / kNodes) * dx,
                                       y0 + (double(k / kPatches) + (b + 0.5) / kNodes) * dy, z});
  const double largest = *std::max_element(exact.begin(), exact.end());
  const double per_ray = file.rays.front().flux;
  double error = 0;
  for (std::size_t k = 0; k < exact.size(); ++k)
    error = std::max(error, std::abs(found[k] - exact[k]) / largest);
  const double sigma = std::sqrt(largest * per_ray) / largest;
  // Four standard deviations hold all 64 patches in 99.6 of 100 files; 1 % for the patches' own
  // quadrature.
  return Row(format, "the file read back, against the exact irradiance", kPatches * kPatches, error,
             sigma, 4 * sigma + 0.01);
}

core::Json ExportRays(const Options& options, const Format& format,
                      const std::vector<PosedLightField>& fields, std::uint64_t seed) {
  const preprocess::RaySampler sampler(fields, options.field);
  const bool luminous = IsLuminous(fields);
  formats::RayFileHeader header;
  header.ray_count = options.rays;
  (luminous ? header.luminous_flux_lm : header.radiant_flux_w) = sampler.flux();
  header.texts = {"drawn from the light field " +
                  std::filesystem::path(options.field).filename().string()};
  if (format.rays == formats::RayFormat::kTm25)
    header.texts.insert(header.texts.end(), {"", "", "luxfield", "luxfield " LUXFIELD_VERSION, "",
                                             "", "rays begin on the filter plane", ""});
  Rays rays(fields, sampler, options.rays, seed);
  const bool colours = rays.tristimulus() && format.rays == formats::RayFormat::kTm25;
  formats::WriteRays(options.output, *format.rays, header, luminous, colours,
                     [&](formats::Ray& ray) { return rays.Next(ray); });
  const auto unit = lightfield::FluxUnitName(fields.front().field.geometry.unit);
  fmt::print("{}: {} rays of {:.6g} {} each, {:.6g} {} in all, {}\n", options.output, options.rays,
             sampler.flux() / double(options.rays), unit, sampler.flux(), unit,
             formats::RayFormatName(*format.rays));
  if (sampler.negative_share() > 0)
    fmt::print(
        "  negative     {:.3g} % of the flux is negative and left out; rays are scaled to "
        "the rest\n",
        100 * sampler.negative_share());
  core::Json json = {{"format", format.name},
                     {"rays", options.rays},
                     {"flux", sampler.flux()},
                     {"unit", unit},
                     {"negative_share", sampler.negative_share()}};
  if (options.check) json["check"] = {CheckRays(options.output, format.name, fields)};
  return json;
}

std::vector<double> Steps(double last, double step, bool with_last) {
  std::vector<double> list;
  const int count = static_cast<int>(std::lround(last / step));
  for (int k = 0; k < count + with_last; ++k) list.push_back(last * k / count);
  return list;
}

// The file read back, in directions between the table's, against the light field.
core::Json CheckTable(const Options& options, const std::string& format,
                      const std::vector<PosedLightField>& fields,
                      const formats::Photometry& written, std::uint64_t seed) {
  constexpr int kReceivers = 200;
  const formats::Photometry read = formats::ReadPhotometry(options.output);
  const double peak = formats::FindPeak(written).intensity_cd;
  core::Random random(seed, 1);
  const double last = written.angles_deg.back();
  const auto largest_error = [&](const formats::Photometry& table) {
    double error = 0;
    for (int k = 0; k < kReceivers; ++k) {
      const Vec3 d = formats::Direction(formats::PhotometryType::kC, 360 * random.Uniform(),
                                        last * random.Uniform());
      error = std::max(error, std::abs(formats::Intensity(table, d) -
                                       formats::IntensityOf(fields, d, options.distance_m)) /
                                  peak);
    }
    return error;
  };
  // What linear interpolation between the angles leaves, in other directions.
  const double interpolation = largest_error(written);
  return Row(format, "the file read back, against the light field", kReceivers, largest_error(read),
             0, 2 * interpolation + 1e-5);
}

core::Json ExportTable(const Options& options, const Format& format,
                       const std::vector<PosedLightField>& fields, std::uint64_t seed) {
  const bool all_around = std::any_of(fields.begin(), fields.end(), [](const auto& posed) {
    return posed.luminaire_from_field.Direction({0, 0, 1}).z < 1 - 1e-9;
  });
  const formats::Photometry table = formats::FarFieldTable(
      fields, Steps(360, options.plane_step_deg, false),
      Steps(all_around ? 180 : 90, options.angle_step_deg, true), options.distance_m);
  const double flux = formats::Flux(table), peak = formats::FindPeak(table).intensity_cd;
  if (!(flux > 0)) throw InputError(options.field, "has no light to export");
  const std::string name = format.name;
  const std::string text =
      name == "eulumdat" ? formats::FormatEulumdat(table, options.output)
                         : formats::FormatLm63(table,
                                               name == "lm-63-2019" ? formats::Lm63Version::k2019
                                                                    : formats::Lm63Version::k2002,
                                               options.output);
  core::WriteFileAtomically(options.output, text);
  const double of_field = core::Luminance(lightfield::TotalFlux(fields));
  const auto unit = lightfield::FluxUnitName(fields.front().field.geometry.unit);
  fmt::print("{}: {}, {} planes of {} angles{}\n", options.output, name, table.planes_deg.size(),
             table.angles_deg.size(),
             options.distance_m ? fmt::format(", intensity at {:.5g} m", *options.distance_m)
                                : std::string());
  fmt::print("  flux         {:.6g} {} of the table, {:.6g} {} of the light field ({:+.3f} %)\n",
             flux, unit, of_field, unit, 100 * (flux / of_field - 1));
  fmt::print("  peak         {:.6g} {}/sr; symmetry {}\n", peak, unit,
             formats::Describe(formats::FindSymmetry(table)));
  core::Json json = {
      {"format", name}, {"planes", table.planes_deg.size()}, {"angles", table.angles_deg.size()},
      {"flux", flux},   {"light_field_flux", of_field},      {"peak", peak},
      {"unit", unit}};
  if (options.check) json["check"] = {CheckTable(options, name, fields, table, seed)};
  return json;
}

core::Json Run(const Options& options, std::uint64_t seed) {
  const Format& format = FormatOf(options);
  if (format.rays && options.distance_m)
    throw InputError("--distance is for intensities, and rays have none; drop it");
  const auto fields = lightfield::ReadLightFields(options.field);
  return format.rays ? ExportRays(options, format, fields, seed)
                     : ExportTable(options, format, fields, seed);
}

std::vector<std::string> FormatNames() {
  std::vector<std::string> names;
  for (const Format& format : kFormats)
    if (names.empty() || names.back() != format.name) names.emplace_back(format.name);
  return names;
}

}  // namespace

void AddExport(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb = program.AddVerb(
      "export", "Write a light field as rays or intensities for other programs",
      [options, &program] { return Run(*options, program.common().seed.value_or(1)); });
  verb.add_option("FILE", options->field, "The .lf.exr")
      ->required()
      ->check(InputFile({core::FileKind::kLightField}));
  verb.add_option("-o,--output", options->output,
                  "Rays: .tm25ray, .dat, .sdf, .ltrf, .ltrf.txt, .speos.ray; intensities: .ies, "
                  ".2019.ies, .ldt")
      ->required()
      ->check(OutputFile());
  verb.add_option("--format", options->format, "Where the ending does not say which")
      ->check(CLI::IsMember(FormatNames()));
  verb.add_option("--rays", options->rays, "Number of rays")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  verb.add_option("--distance", options->distance_m,
                  "Intensities: as a photometer at this distance from the luminaire's origin takes "
                  "them, m (default: the far field)")
      ->check(CLI::Range(1e-3, 1e6));
  verb.add_option("--plane-step", options->plane_step_deg, "Intensities: between planes C, degrees")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 90.0));
  verb.add_option("--angle-step", options->angle_step_deg,
                  "Intensities: between angles gamma, degrees")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 45.0));
  verb.add_flag("--check", options->check,
                "Read the file back and compare it with the exact light field");
}

}  // namespace luxfield::cli
