#include "luxfield/reconstruct/solve/import_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/import_rays_json.h"
#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::reconstruct {
namespace {

using formats::Ray;
using formats::RayFile;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec3;

constexpr double kMostSteep = 0.01;         // of a beam's flux, beyond the face's pyramid
constexpr double kSteepest = 2;             // |dx|, |dy| over dz of a beam's rays
constexpr double kGrazingCoverage = 0.99;   // grazing rays cross any planes infinitely far out
constexpr double kPlaceholderFactor = 100;  // a header so far off its rays states nothing
constexpr double kFluxAgrees = 0.1;         // relative, header and rays
constexpr double kMostLost = 1e-4;          // without a warning; of the flux
constexpr double kMostNegative = 0.1;       // of the positive, in the light field
constexpr double kMostNoise = 0.5;          // negative over positive, in the least-squares fit
constexpr double kFluxKept = 0.01;          // relative, of the fit
constexpr double kWideWindow = 4;           // over that of 99 % of the flux

bool HasTristimulus(const RayFile& file) {
  return !file.rays.empty() && std::all_of(file.rays.begin(), file.rays.end(), [](const Ray& ray) {
    return ray.tristimulus.has_value();
  });
}

// Which flux the rays are scaled to.
void SetFlux(const RayFile& file, const ImportRaysOptions& options, RayImportReport& report) {
  for (const Ray& ray : file.rays) report.ray_flux += ray.flux;
  report.header_flux =
      file.flux_is_luminous ? file.header.luminous_flux_lm : file.header.radiant_flux_w;
  report.flux_from = options.flux_from;
  const bool stated = report.header_flux && report.ray_flux > 0;
  if (options.flux_from == RayFluxFrom::kAuto) {
    const double ratio = stated ? *report.header_flux / report.ray_flux : 0;
    report.flux_from = ratio > 1 / kPlaceholderFactor && ratio < kPlaceholderFactor
                           ? RayFluxFrom::kHeader
                           : RayFluxFrom::kRays;
  }
  if (report.flux_from == RayFluxFrom::kHeader) {
    if (!stated)
      throw InputError("the file's header states no flux; take the rays' own or state it");
    report.scale = *report.header_flux / report.ray_flux;
  }
  if (report.flux_from == RayFluxFrom::kValue) {
    if (!(options.flux > 0 && std::isfinite(options.flux)))
      throw InputError(fmt::format("a flux of {} is not above 0", options.flux));
    if (!(report.ray_flux > 0)) throw InputError("no ray of the file has flux to be scaled");
    report.scale = options.flux / report.ray_flux;
  }
}

// Whether a direction lies within the pyramid |dx|, |dy| <= slope dz.
bool WithinPyramid(Vec3 direction, double slope) {
  return direction.z > 0 &&
         std::max(std::abs(direction.x), std::abs(direction.y)) <= slope * direction.z;
}

// Which rays fields take: of a beam, those within the pyramid of `slope`.
struct TakenRays {
  RayDirections directions = RayDirections::kBeam;
  double slope = 1;
  bool grazing = false;  // some ray towards +z is steeper than windows are made for
};

TakenRays Resolve(const RayFile& file, const ImportRaysOptions& options, double ray_flux) {
  double outside_face = 0, grazing = 0, backward = 0;
  for (const Ray& ray : file.rays) {
    const Vec3 direction = options.luminaire_from_file.Direction(ray.direction);
    if (FaceOf(direction) != kForwardFace) outside_face += ray.flux;
    if (!WithinPyramid(direction, kSteepest)) (direction.z > 0 ? grazing : backward) += ray.flux;
  }
  TakenRays taken{.directions = options.directions, .grazing = grazing > 0};
  if (options.geometry) {
    taken.directions = RayDirections::kOne;
  } else if (options.directions == RayDirections::kAuto) {
    const bool beam =
        outside_face <= kMostSteep * ray_flux && grazing + backward <= kMostLost * ray_flux;
    taken.directions = beam ? RayDirections::kBeam : RayDirections::kCube;
    taken.slope = kSteepest;
  }
  return taken;
}

// Rec. 709 has no colour whose red, green or blue is negative; laying C >= 0 on it would add light.
bool HasNegativeChannel(const lightfield::LightField& field) {
  const auto flux = lightfield::TotalFlux(field);
  return *std::min_element(flux.begin(), flux.end()) < 0;
}

double LuminanceOf(const LightField& field) {
  const auto flux = lightfield::TotalFlux(field);
  return field.geometry.channels == 3 ? core::Luminance({flux[0], flux[1], flux[2]}) : flux[0];
}

// Flux of the coefficients above and below 0.
struct SignedFlux {
  double positive = 0, negative = 0;

  void Add(const LightField& field) {
    const auto& g = field.geometry;
    double above = 0, below = 0;
    for (const float c : field.data) (c < 0 ? below : above) += std::abs(static_cast<double>(c));
    const double flux = g.lattice.texel_area_m2() * g.grid.PhiIntegral();
    positive += flux * above;
    negative += flux * below;
  }
  double ratio() const { return positive > 0 ? negative / positive : 0; }
};

void Project(const GramSolver& solver, LightField& field) {
  const auto& g = field.geometry;
  std::vector<float*> images;
  images.reserve(static_cast<std::size_t>(g.grid.count()));
  for (int m = 0; m < g.grid.count(); ++m) images.push_back(field.image(m, 0).data());
  ProjectNonNegative(solver, images.data(), g.plane_size() * g.channels);
}

void Add(const RayTally& more, RayTally& sum) {
  sum.rays += more.rays;
  sum.flux += more.flux;
}

class RayImporter {
 public:
  RayImporter(const RayFile& file, const ImportRaysOptions& options)
      : file_(file), options_(options) {
    options.luminaire_from_file.Validate("luminaire_from_file");
    SetFlux(file, options, result_.report);
    taken_ = Resolve(file, options, result_.report.ray_flux);
    if (taken_.directions == RayDirections::kCube && options.planes.filter_z_m)
      throw InputError(
          "the z of plane F is of one light field and this file's light takes several; leave it "
          "out, or ask for one field");
  }

  RayImport Run() {
    RayImportReport& report = result_.report;
    report.all = {file_.rays.size(), report.scale * report.ray_flux};
    for (int face = 0; face < kFaces; ++face) {
      const auto lines = LinesOf(file_, options_.luminaire_from_file, face,
                                 [&](Vec3 direction) { return Takes(face, direction); });
      double flux = 0;
      for (const RayLine& line : lines) flux += line.flux;
      if (flux > 0) AddField(face, lines);
    }
    CountElsewhere();
    if (report.used.flux <= 0)
      throw InputError(fmt::format(
          "none of {} rays crosses both planes ({} travel backwards, {} beside the beam, {} miss "
          "the filter plane's window, {} the image plane's); change the pose or the planes",
          report.all.rays, report.backward.rays, report.beside.rays,
          report.missed_filter_plane.rays, report.missed_image_plane.rays));
    report.negative_energy = signs_.ratio();
    report.filter_z_m = report.fields.front().filter_z_m;
    return std::move(result_);
  }

 private:
  // Whether the field of that face takes rays of that direction.
  bool Takes(int face, Vec3 direction) const {
    if (taken_.directions == RayDirections::kCube) return FaceOf(direction) == face;
    if (face != kForwardFace) return false;
    return taken_.directions == RayDirections::kOne ? direction.z > 0
                                                    : WithinPyramid(direction, taken_.slope);
  }

  void CountElsewhere() {
    RayImportReport& report = result_.report;
    for (const Ray& ray : file_.rays) {
      const Vec3 direction = options_.luminaire_from_file.Direction(ray.direction);
      bool taken = ray.flux == 0 && taken_.directions == RayDirections::kCube;
      for (int face = 0; face < kFaces; ++face) taken = taken || Takes(face, direction);
      if (!taken)
        Add({1, report.scale * ray.flux}, direction.z > 0 ? report.beside : report.backward);
    }
  }

  RayPlanes PlanesFor(const std::vector<RayLine>& lines) const {
    RayPlanes planes;
    if (options_.geometry) {
      planes.geometry = *options_.geometry;
      CheckInnerCells(planes.geometry.grid, 0);
    } else {
      RayPlaneOptions how = options_.planes;
      const bool grazing = taken_.directions == RayDirections::kOne && taken_.grazing;
      how.coverage = options_.coverage.value_or(grazing ? kGrazingCoverage : 1.0);
      if (grazing && how.coverage == 1)
        throw InputError(
            "coverage 1 is of no finite window where rays graze the planes; choose less, or "
            "several fields");
      planes = ChooseRayPlanes(lines, how);
    }
    planes.geometry.channels = HasTristimulus(file_) ? 3 : 1;
    planes.geometry.unit =
        file_.flux_is_luminous ? lightfield::FluxUnit::kLumen : lightfield::FluxUnit::kWatt;
    planes.geometry.Validate("the planes for the rays");
    return planes;
  }

  lightfield::PosedLightField Place(int face, const RayPlanes& planes) const {
    lightfield::PosedLightField posed;
    if (taken_.directions == RayDirections::kCube) {
      posed.name = FaceName(face);
      posed.luminaire_from_field = LuminaireFromFace(face);
      posed.luminaire_from_field.translation_m =
          posed.luminaire_from_field.Direction({0, 0, planes.filter_z_m});
    }
    posed.field = LightField(planes.geometry);
    return posed;
  }

  void AddField(int face, const std::vector<RayLine>& lines) {
    RayImportReport& report = result_.report;
    const RayPlanes planes = PlanesFor(lines);
    const RayBins bins = BinRays(lines, planes.geometry, planes.filter_z_m, report.scale);
    RayFieldReport field{.name = FaceName(face),
                         .missed_filter_plane = bins.missed_filter_plane,
                         .missed_image_plane = bins.missed_image_plane,
                         .used = bins.used,
                         .filter_z_m = planes.filter_z_m,
                         .relative_window = planes.relative_window};
    Add(field.missed_filter_plane, report.missed_filter_plane);
    Add(field.missed_image_plane, report.missed_image_plane);
    Add(field.used, report.used);
    if (!(field.used.flux > 0)) return;
    auto c = Place(face, planes), sigma = c;
    const GramSolver solver(planes.geometry.grid);
    FitRays(file_, bins, report.scale, solver, c.field, sigma.field);
    SignedFlux signs;
    signs.Add(c.field);
    signs_.Add(c.field);
    field.negative_energy = signs.ratio();
    field.non_negative = options_.signs == RaySigns::kNonNegative ||
                         (options_.signs == RaySigns::kAuto && !HasNegativeChannel(c.field));
    if (field.non_negative) Project(solver, c.field);
    field.fitted_flux = LuminanceOf(c.field);
    report.fitted_flux += field.fitted_flux;
    report.fields.push_back(std::move(field));
    result_.coefficients.push_back(std::move(c));
    result_.sigma.push_back(std::move(sigma));
  }

  const RayFile& file_;
  const ImportRaysOptions& options_;
  TakenRays taken_;
  SignedFlux signs_;
  RayImport result_;
};

const char* FluxFromName(RayFluxFrom from) {
  switch (from) {
    case RayFluxFrom::kHeader:
      return "header";
    case RayFluxFrom::kValue:
      return "value";
    default:
      return "rays";
  }
}

}  // namespace

RayImport ImportRays(const RayFile& file, const ImportRaysOptions& options) {
  return RayImporter(file, options).Run();
}

std::vector<std::string> Warnings(const RayImport& result) {
  const RayImportReport& r = result.report;
  const auto unit = lightfield::FluxUnitName(result.coefficients.front().field.geometry.unit);
  std::vector<std::string> warnings;
  if (r.header_flux && r.flux_from != RayFluxFrom::kValue &&
      std::abs(*r.header_flux - r.ray_flux) > kFluxAgrees * r.ray_flux)
    warnings.push_back(fmt::format(
        "the header states {:.6g} {} and the rays add up to {:.6g} {}; the {} flux is used: choose "
        "with --flux header, --flux rays or --flux VALUE",
        *r.header_flux, unit, r.ray_flux, unit,
        r.flux_from == RayFluxFrom::kHeader ? "header's" : "rays'"));
  if (r.lost_share() > kMostLost)
    warnings.push_back(fmt::format(
        "{:.3g} % of the flux is in no light field ({:.3g} % backward, {:.3g} % beside the beam, "
        "{:.3g} % beside the windows): --faces cube with --coverage 1 takes all of it",
        100 * r.lost_share(), 100 * r.backward.flux / r.all.flux, 100 * r.beside.flux / r.all.flux,
        100 * (r.missed_filter_plane.flux + r.missed_image_plane.flux) / r.all.flux));
  SignedFlux left;
  for (const auto& posed : result.coefficients) left.Add(posed.field);
  if (left.ratio() > kMostNegative)
    warnings.push_back(fmt::format(
        "{:.3g} % of the light field is negative: solve with --non-negative, or with fewer texels "
        "and functions",
        100 * left.ratio()));
  if (r.negative_energy > kMostNoise)
    warnings.push_back(
        fmt::format("negative coefficients of the least-squares fit are {:.3g} % of the positive "
                    "ones: rays too "
                    "few, or light too sharp, for its lattice and grid",
                    100 * r.negative_energy));
  if (std::abs(r.fitted_flux - r.used.flux) > kFluxKept * r.used.flux)
    warnings.push_back(fmt::format(
        "the light field has {:.3g} % of the flux of its rays: colours outside Rec. 709 were cut "
        "off; solve with --signed",
        100 * r.fitted_flux / r.used.flux));
  for (const auto& field : r.fields)
    if (field.relative_window > kWideWindow)
      warnings.push_back(fmt::format(
          "field {}: the window on F is {:.3g} times as wide as that of 99 % of its light; "
          "--coverage 0.99 leaves the far rays out and shows the rest finer",
          field.name, field.relative_window));
  return warnings;
}

nlohmann::json ToJson(const RayImportReport& report) {
  const auto tally = [](const RayTally& t) {
    return nlohmann::json{{"rays", t.rays}, {"flux", t.flux}};
  };
  nlohmann::json fields = nlohmann::json::array();
  for (const auto& field : report.fields)
    fields.push_back({{"name", field.name},
                      {"missed_filter_plane", tally(field.missed_filter_plane)},
                      {"missed_image_plane", tally(field.missed_image_plane)},
                      {"used", tally(field.used)},
                      {"fitted_flux", field.fitted_flux},
                      {"negative_energy", field.negative_energy},
                      {"non_negative", field.non_negative},
                      {"filter_z_m", field.filter_z_m}});
  nlohmann::json json{{"ray_flux", report.ray_flux},
                      {"flux_from", FluxFromName(report.flux_from)},
                      {"scale", report.scale},
                      {"all", tally(report.all)},
                      {"backward", tally(report.backward)},
                      {"beside", tally(report.beside)},
                      {"missed_filter_plane", tally(report.missed_filter_plane)},
                      {"missed_image_plane", tally(report.missed_image_plane)},
                      {"used", tally(report.used)},
                      {"lost_share", report.lost_share()},
                      {"fitted_flux", report.fitted_flux},
                      {"negative_energy", report.negative_energy},
                      {"filter_z_m", report.filter_z_m},
                      {"fields", std::move(fields)}};
  if (report.header_flux) json["header_flux"] = *report.header_flux;
  return json;
}

}  // namespace luxfield::reconstruct
