#include "luxfield/reconstruct/solve/import_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
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

// How far from +z the rays go: within |dx|, |dy| <= dz, within kSteepest dz, beyond, with dz <= 0.
enum Steepness { kWithinFace, kSteep, kGrazing, kBackward, kSteepnesses };

Steepness SteepnessOf(Vec3 direction) {
  if (!(direction.z > 0)) return kBackward;
  const double most = std::max(std::abs(direction.x), std::abs(direction.y));
  return most <= direction.z ? kWithinFace : most <= kSteepest * direction.z ? kSteep : kGrazing;
}

// What the first pass finds. Flux as stored.
struct RayTotals {
  RayTally all;
  std::array<RayTally, kSteepnesses> by_steepness;
  std::array<RayTally, kFaces> by_face;
  bool tristimulus = true;  // every ray has these values

  void Add(const Ray& ray, Vec3 direction) {
    const RayTally one{1, ray.flux};
    all.Add(one);
    by_steepness[SteepnessOf(direction)].Add(one);
    by_face[static_cast<std::size_t>(FaceOf(direction))].Add(one);
    tristimulus = tristimulus && ray.tristimulus.has_value();
  }
};

// Which flux the rays are scaled to.
void SetFlux(const RayFile& file, const ImportRaysOptions& options, RayImportReport& report) {
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

// Which rays fields take.
struct TakenRays {
  RayDirections directions = RayDirections::kBeam;
  Steepness most = kWithinFace;  // of one field's rays
  bool grazing = false;          // some ray towards +z is steeper than windows are made for

  // The face whose field takes rays of that direction; none of them: kFaces.
  int FaceTaking(Vec3 direction) const {
    if (directions == RayDirections::kCube) return FaceOf(direction);
    return SteepnessOf(direction) <= most ? kForwardFace : kFaces;
  }
};

TakenRays Resolve(const RayTotals& totals, const ImportRaysOptions& options) {
  const auto& steepness = totals.by_steepness;
  TakenRays taken{.directions = options.directions, .grazing = steepness[kGrazing].flux > 0};
  if (options.geometry) {
    taken.directions = RayDirections::kOne;
  } else if (options.directions == RayDirections::kAuto) {
    double outside_face = 0;
    for (int face = 0; face < kFaces; ++face)
      if (face != kForwardFace) outside_face += totals.by_face[face].flux;
    const bool beam =
        outside_face <= kMostSteep * totals.all.flux &&
        steepness[kGrazing].flux + steepness[kBackward].flux <= kMostLost * totals.all.flux;
    taken.directions = beam ? RayDirections::kBeam : RayDirections::kCube;
    taken.most = kSteep;
  }
  if (taken.directions == RayDirections::kOne) taken.most = kGrazing;
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

class RayImporter {
 public:
  RayImporter(const RayStream& rays, const ImportRaysOptions& options)
      : rays_(rays), options_(options) {
    options.luminaire_from_file.Validate("luminaire_from_file");
    for (int face = 0; face < kFaces; ++face)
      face_from_file_[face] = LuminaireFromFace(face).Inverse() * options.luminaire_from_file;
    file_ = Pass([&](const Ray& ray, Vec3 direction) { totals_.Add(ray, direction); });
    counted_ = true;
    result_.report.ray_flux = totals_.all.flux;
    SetFlux(file_, options, result_.report);
    taken_ = Resolve(totals_, options);
    if (taken_.directions == RayDirections::kCube && options.planes.filter_z_m)
      throw InputError(
          "the z of plane F is of one light field and this file's light takes several; leave it "
          "out, or ask for one field");
  }

  RayImport Run() {
    RayImportReport& report = result_.report;
    CountElsewhere();
    const std::vector<int> faces = LitFaces();
    const std::vector<RayPlanes> planes = PlanesOf(faces);
    for (std::size_t k = 0; k < faces.size(); ++k) AddField(faces[k], planes[k]);
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
  // Goes through all rays, with their directions in the luminaire's frame.
  RayFile Pass(const std::function<void(const Ray& ray, Vec3 direction)>& take) const {
    constexpr std::uint64_t kStep = 65536;
    core::Progress progress("reading rays", totals_.all.rays);
    std::uint64_t count = 0;
    RayFile file = rays_([&](const Ray& ray) {
      take(ray, options_.luminaire_from_file.Direction(ray.direction));
      if (++count % kStep != 0) return;
      core::ThrowIfInterrupted();
      progress.Advance(kStep);
    });
    if (counted_ && count != totals_.all.rays)
      throw InputError(fmt::format(
          "the file had {} rays and has {} when read again; leave it alone until it is imported",
          totals_.all.rays, count));
    return file;
  }

  // The same of those that fields take, as lines in the frame of their face.
  void PassLines(const std::function<void(int face, const RayLine&)>& take) const {
    Pass([&](const Ray& ray, Vec3 direction) {
      const int face = taken_.FaceTaking(direction);
      if (face < kFaces) take(face, LineOf(ray, face_from_file_[face]));
    });
  }

  RayTally Scaled(const RayTally& tally) const {
    return {tally.rays, result_.report.scale * tally.flux};
  }

  void CountElsewhere() {
    RayImportReport& report = result_.report;
    report.all = Scaled(totals_.all);
    if (taken_.directions == RayDirections::kCube) return;
    report.backward = Scaled(totals_.by_steepness[kBackward]);
    for (int steepness = taken_.most + 1; steepness < kBackward; ++steepness)
      report.beside.Add(Scaled(totals_.by_steepness[steepness]));
  }

  // Those whose fields have flux.
  std::vector<int> LitFaces() const {
    std::vector<int> faces;
    if (taken_.directions == RayDirections::kCube) {
      for (int face = 0; face < kFaces; ++face)
        if (totals_.by_face[face].flux > 0) faces.push_back(face);
    } else {
      double flux = 0;
      for (int steepness = 0; steepness <= taken_.most; ++steepness)
        flux += totals_.by_steepness[steepness].flux;
      if (flux > 0) faces.push_back(kForwardFace);
    }
    return faces;
  }

  RayPlaneOptions PlaneOptions() const {
    RayPlaneOptions how = options_.planes;
    const bool grazing = taken_.directions == RayDirections::kOne && taken_.grazing;
    how.coverage = options_.coverage.value_or(grazing ? kGrazingCoverage : 1.0);
    if (grazing && how.coverage == 1)
      throw InputError(
          "coverage 1 is of no finite window where rays graze the planes; choose less, or "
          "several fields");
    return how;
  }

  // The planes of those faces, given or chosen.
  std::vector<RayPlanes> PlanesOf(const std::vector<int>& faces) const {
    std::vector<RayPlanes> all(faces.size());
    if (options_.geometry) {
      for (RayPlanes& planes : all) planes.geometry = *options_.geometry;
      CheckInnerCells(options_.geometry->grid, 0);
    } else {
      all = ChosenPlanes(faces);
    }
    for (RayPlanes& planes : all) {
      planes.geometry.channels = totals_.tristimulus ? 3 : 1;
      planes.geometry.unit =
          file_.flux_is_luminous ? lightfield::FluxUnit::kLumen : lightfield::FluxUnit::kWatt;
      planes.geometry.Validate("the planes for the rays");
    }
    RequireRoom(all);
    return all;
  }

  // Sums of the field at hand, in double precision, and coefficients of all.
  void RequireRoom(const std::vector<RayPlanes>& all) const {
    constexpr std::uint64_t kBesideFits = std::uint64_t{64} << 20;  // blocks and samples of rays
    std::uint64_t most = 0, kept = 0;
    for (const RayPlanes& planes : all) {
      const std::uint64_t values = planes.geometry.value_count() * (options_.sigma ? 2 : 1);
      most = std::max(most, sizeof(double) * (values + 2 * planes.geometry.plane_size()));
      kept += sizeof(float) * values;
    }
    const std::uint64_t needed = most + kept + kBesideFits;
    if (options_.memory_bytes == 0 || needed <= options_.memory_bytes) return;
    const LuminaireGeometry& g = all.front().geometry;
    throw InputError(fmt::format(
        "{} light fields, the first of {} x {} images of {} x {} texels, take {} MiB while they "
        "are "
        "fitted where {} are allowed; allow {} MiB more, or ask for a smaller grid or lattice",
        all.size(), g.grid.width, g.grid.height, g.lattice.width, g.lattice.height, needed >> 20,
        options_.memory_bytes >> 20, ((needed - options_.memory_bytes) >> 20) + 1));
  }

  std::vector<RayPlanes> ChosenPlanes(const std::vector<int>& faces) const {
    std::array<std::optional<RayPlaneChoice>, kFaces> choices;
    for (const int face : faces) choices[face].emplace(PlaneOptions());
    for (bool more = !faces.empty(); more;) {
      PassLines([&](int face, const RayLine& line) {
        if (choices[face]) choices[face]->Add(line);
      });
      more = false;
      for (const int face : faces) more |= choices[face]->EndPass();
    }
    std::vector<RayPlanes> chosen;
    for (const int face : faces) chosen.push_back(choices[face]->planes());
    return chosen;
  }

  lightfield::PosedLightField Place(int face, const RayPlanes& planes) const {
    lightfield::PosedLightField posed;
    if (taken_.directions == RayDirections::kCube) {
      posed.name = FaceName(face);
      posed.luminaire_from_field = LuminaireFromFace(face);
      posed.luminaire_from_field.translation_m =
          posed.luminaire_from_field.Direction({0, 0, planes.filter_z_m});
    }
    return posed;
  }

  void AddField(int face, const RayPlanes& planes) {
    RayImportReport& report = result_.report;
    const GramSolver solver(planes.geometry.grid);
    RayFit fit(planes.geometry, solver,
               {.filter_z_m = planes.filter_z_m, .scale = report.scale, .sigma = options_.sigma});
    PassLines([&](int of, const RayLine& line) {
      if (of == face) fit.Add(line);
    });
    fit.AddBlock();
    RayFieldReport field{.name = FaceName(face),
                         .missed_filter_plane = fit.missed_filter_plane(),
                         .missed_image_plane = fit.missed_image_plane(),
                         .used = fit.used(),
                         .filter_z_m = planes.filter_z_m,
                         .relative_window = planes.relative_window};
    report.missed_filter_plane.Add(field.missed_filter_plane);
    report.missed_image_plane.Add(field.missed_image_plane);
    report.used.Add(field.used);
    if (!(field.used.flux > 0)) return;
    auto c = Place(face, planes), sigma = c;
    c.field = fit.Solution();
    if (options_.sigma) sigma.field = fit.Sigma();
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
    if (options_.sigma) result_.sigma.push_back(std::move(sigma));
  }

  const RayStream& rays_;
  const ImportRaysOptions& options_;
  std::array<lightfield::RigidPose, kFaces> face_from_file_;
  RayTotals totals_;
  bool counted_ = false;  // totals_ are those of the file
  RayFile file_;          // without its rays
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

RayImport ImportRays(const RayStream& rays, const ImportRaysOptions& options) {
  return RayImporter(rays, options).Run();
}

RayImport ImportRays(const RayFile& file, const ImportRaysOptions& options) {
  const RayFile without{file.header, file.flux_is_luminous, {}};
  return ImportRays(
      [&](const formats::RayTaker& take) {
        for (const Ray& ray : file.rays) take(ray);
        return without;
      },
      options);
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
