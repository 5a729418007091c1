#include "luxfield/formats/export_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/lightfield/quadrature.h"

namespace luxfield::formats {
namespace {

using lightfield::PosedLightField;
using lightfield::Vec3;

// Six significant digits are the least that a format keeps.
constexpr double kDigits = 1e-5;

// Largest difference between the table and the light field, of the peak.
double LargestError(const Photometry& table, std::span<const PosedLightField> fields,
                    std::optional<double> distance_m, const std::vector<Vec3>& directions,
                    double peak) {
  double error = 0;
  for (const Vec3 d : directions)
    error = std::max(error, std::abs(Intensity(table, d) - IntensityOf(fields, d, distance_m)));
  return error / peak;
}

// Directions between two planes and two angles of a table.
struct Cell {
  double plane_from, plane_to, angle_from, angle_to;
};

// Those with more than `limit` cd in a corner.
std::vector<Cell> LitCells(const Photometry& p, double limit) {
  std::vector<Cell> cells;
  const std::size_t planes = p.planes_deg.size();
  for (std::size_t k = 0; k < planes; ++k)
    for (std::size_t j = 0; j + 1 < p.angles_deg.size(); ++j) {
      const std::size_t next = (k + 1) % planes;
      if (std::max({p.at(k, j), p.at(k, j + 1), p.at(next, j), p.at(next, j + 1)}) > limit)
        cells.push_back({p.planes_deg[k], next > 0 ? p.planes_deg[next] : 360, p.angles_deg[j],
                         p.angles_deg[j + 1]});
    }
  return cells;
}

constexpr std::size_t kZones = 8, kSectors = 16, kPatches = kZones * kSectors;

// Patches of a sphere about the luminaire's origin: zones about the light's mean direction, each cut
// into even sectors. Angles in radians.
struct Sphere {
  double radius_m = 0;
  Vec3 x{1, 0, 0}, y{0, 1, 0}, axis{0, 0, 1};
  std::vector<double> zone_edges;  // from 0 to pi

  Vec3 Towards(double theta, double phi) const {
    return std::sin(theta) * (std::cos(phi) * x + std::sin(phi) * y) + std::cos(theta) * axis;
  }

  // None where the ray begins outside.
  std::optional<std::size_t> PatchHit(const Ray& ray) const {
    const Vec3 p = ray.position_m, d = ray.direction;
    const double along = lightfield::Dot(p, d), square = lightfield::Dot(d, d);
    const double inside = radius_m * radius_m - lightfield::Dot(p, p);
    if (!(inside > 0)) return {};
    const double way = (std::sqrt(along * along + square * inside) - along) / square;
    const Vec3 hit = (1 / radius_m) * (p + way * d);
    const double theta = std::acos(std::clamp(lightfield::Dot(hit, axis), -1.0, 1.0));
    const double phi = std::atan2(lightfield::Dot(hit, y), lightfield::Dot(hit, x));
    const auto above = std::upper_bound(zone_edges.begin() + 1, zone_edges.end() - 1, theta);
    const auto zone = static_cast<std::size_t>(above - zone_edges.begin()) - 1;
    const double turn = phi / (2 * std::numbers::pi) + (phi < 0 ? 1 : 0);
    const auto sector = static_cast<std::size_t>(turn * double(kSectors));
    return zone * kSectors + std::min(sector, kSectors - 1);
  }
};

// Exact I(direction) sin(theta) at the middles of 2-degree zones and of the sectors.
std::vector<double> CoarseLight(const Sphere& sphere, std::span<const PosedLightField> fields,
                                std::size_t bands) {
  std::vector<double> light(bands * kSectors);
  core::ParallelFor(light.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const double theta = std::numbers::pi * (double(k / kSectors) + 0.5) / double(bands);
      const double phi = 2 * std::numbers::pi * (double(k % kSectors) + 0.5) / double(kSectors);
      light[k] = std::sin(theta) *
                 std::max(0.0, IntensityOf(fields, sphere.Towards(theta, phi), sphere.radius_m));
    }
  });
  return light;
}

Vec3 MeanDirection(const Sphere& sphere, const std::vector<double>& light, std::size_t bands) {
  Vec3 sum;
  for (std::size_t k = 0; k < light.size(); ++k)
    sum = sum +
          light[k] * sphere.Towards(std::numbers::pi * (double(k / kSectors) + 0.5) / double(bands),
                                    2 * std::numbers::pi * (double(k % kSectors) + 0.5) / kSectors);
  return sum;
}

// About the mean direction of the light, with zones of about equal flux.
Sphere SphereAround(std::span<const PosedLightField> fields) {
  constexpr std::size_t kBands = 90;
  Sphere sphere;
  sphere.radius_m = 2 * ReachOfSupports(fields);
  const Vec3 mean = MeanDirection(sphere, CoarseLight(sphere, fields, kBands), kBands);
  if (lightfield::Length(mean) > 0) sphere.axis = lightfield::Normalized(mean);
  const Vec3 aside = std::abs(sphere.axis.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  sphere.y = lightfield::Normalized(lightfield::Cross(sphere.axis, aside));
  sphere.x = lightfield::Cross(sphere.y, sphere.axis);

  const std::vector<double> light = CoarseLight(sphere, fields, kBands);
  const double all = std::accumulate(light.begin(), light.end(), 0.0);
  sphere.zone_edges = {0};
  double sum = 0;
  for (std::size_t band = 0; band < kBands; ++band) {
    const auto first = light.begin() + std::ptrdiff_t(band * kSectors);
    const double to = sum + std::accumulate(first, first + kSectors, 0.0);
    while (sphere.zone_edges.size() < kZones) {
      const double edge = all * double(sphere.zone_edges.size()) / kZones;
      if (!(edge < to)) break;
      sphere.zone_edges.push_back(std::numbers::pi * (double(band) + (edge - sum) / (to - sum)) /
                                  kBands);
    }
    sum = to;
  }
  sphere.zone_edges.push_back(std::numbers::pi);
  return sphere;
}

struct Rectangle {
  double theta0, theta1, phi0, phi1;
};

// Integral over a patch, halved in both directions where halves change it by more than a tolerance.
class PatchFlux {
 public:
  PatchFlux(const Sphere& sphere, std::span<const PosedLightField> fields, double tolerance)
      : sphere_(sphere), fields_(fields), tolerance_(tolerance) {}

  // In strips, lest the light of a wide zone's edge falls between its nodes.
  double Of(const Rectangle& r) {
    constexpr double kWidest = 8 * std::numbers::pi / 180;
    const int strips = static_cast<int>(std::ceil((r.theta1 - r.theta0) / kWidest));
    double sum = 0;
    for (int k = 0; k < strips; ++k) {
      const Rectangle strip{std::lerp(r.theta0, r.theta1, double(k) / strips),
                            std::lerp(r.theta0, r.theta1, double(k + 1) / strips), r.phi0, r.phi1};
      sum += Refined(strip, ByGauss(strip), kMostHalvings);
    }
    return sum;
  }
  double difference() const { return difference_; }  // what the last halvings changed

 private:
  static constexpr int kMostHalvings = 5;

  double ByGauss(const Rectangle& r) const {
    return lightfield::Gauss3(r.phi0, r.phi1, [&](double phi) {
      return lightfield::Gauss3(r.theta0, r.theta1, [&](double theta) {
        return std::sin(theta) *
               IntensityOf(fields_, sphere_.Towards(theta, phi), sphere_.radius_m);
      });
    });
  }

  double Refined(const Rectangle& r, double whole, int halvings) {
    const double theta = (r.theta0 + r.theta1) / 2, phi = (r.phi0 + r.phi1) / 2;
    const Rectangle quarters[] = {{r.theta0, theta, r.phi0, phi},
                                  {r.theta0, theta, phi, r.phi1},
                                  {theta, r.theta1, r.phi0, phi},
                                  {theta, r.theta1, phi, r.phi1}};
    double parts[4], sum = 0;
    for (int k = 0; k < 4; ++k) sum += parts[k] = ByGauss(quarters[k]);
    if (std::abs(sum - whole) < tolerance_ || halvings == 1) {
      difference_ += std::abs(sum - whole);
      return sum;
    }
    sum = 0;
    for (int k = 0; k < 4; ++k) sum += Refined(quarters[k], parts[k], halvings - 1);
    return sum;
  }

  const Sphere& sphere_;
  std::span<const PosedLightField> fields_;
  double tolerance_, difference_ = 0;
};

// Flux through each patch, and what its quadrature may be off by.
struct PatchFluxes {
  std::vector<double> exact, difference;
};

PatchFluxes FluxesOf(const Sphere& sphere, std::span<const PosedLightField> fields) {
  // Of an average patch 0.1 %.
  const double tolerance = 1e-3 / kPatches * core::Luminance(lightfield::TotalFlux(fields));
  PatchFluxes fluxes{std::vector<double>(kPatches), std::vector<double>(kPatches)};
  core::Progress progress("check", kPatches);
  core::ParallelFor(kPatches, 1, [&](std::size_t begin, std::size_t end) {
    core::ThrowIfInterrupted();
    for (std::size_t k = begin; k < end; ++k) {
      const double sector = 2 * std::numbers::pi / kSectors, phi = sector * double(k % kSectors);
      PatchFlux flux(sphere, fields, tolerance);
      fluxes.exact[k] = flux.Of({sphere.zone_edges[k / kSectors],
                                 sphere.zone_edges[k / kSectors + 1], phi, phi + sector});
      fluxes.difference[k] = flux.difference();
    }
    progress.Advance(end - begin);
  });
  return fluxes;
}

}  // namespace

ExportCheck CheckRays(const std::filesystem::path& path, std::span<const PosedLightField> fields,
                      double left_out) {
  const Sphere sphere = SphereAround(fields);
  std::vector<double> found(kPatches, 0);
  double per_ray = 0;
  std::uint64_t rays = 0;
  StreamRays(path, [&](const Ray& ray) {
    if (rays++ % 65536 == 0) core::ThrowIfInterrupted();
    per_ray = ray.flux;
    if (const auto patch = sphere.PatchHit(ray)) found[*patch] += ray.flux;
  });
  if (rays < 25 * kPatches)
    throw InputError(path.string(), fmt::format("has {} rays, too few for --check", rays),
                     fmt::format("raise --rays to {} or more", 25 * kPatches));
  const PatchFluxes exact = FluxesOf(sphere, fields);
  const double largest = *std::max_element(exact.exact.begin(), exact.exact.end());
  ExportCheck check;
  check.judge = "light field's flux through patches of a sphere";
  check.receivers = static_cast<int>(kPatches);
  double quadrature = 0;
  for (std::size_t k = 0; k < kPatches; ++k) {
    const double error = found[k] - exact.exact[k];
    check.max_rel_error = std::max(check.max_rel_error, std::abs(error) / largest);
    quadrature = std::max(quadrature, exact.difference[k] / largest);
    // Where next to nothing is expected the squares are no chi-squared.
    if (exact.exact[k] < 10 * per_ray) continue;
    check.chi_squared += error * error / (exact.exact[k] * per_ray);
    ++check.degrees;
  }
  check.degrees = std::max(0, check.degrees - 1);
  check.mc_sigma = std::sqrt(per_ray / largest);
  check.stated_error = 5 * check.mc_sigma + quadrature + left_out / largest;
  return check;
}

ExportCheck CheckIntensities(const std::filesystem::path& path, const FarField& written,
                             std::span<const PosedLightField> fields,
                             std::optional<double> distance_m) {
  constexpr std::size_t kMostReceivers = 2000;
  const Photometry read = ReadPhotometry(path);
  const auto& planes = written.table.planes_deg;
  const auto& angles = written.table.angles_deg;
  const std::size_t step = std::max<std::size_t>(1, planes.size() * angles.size() / kMostReceivers);
  std::vector<Vec3> directions;
  for (std::size_t k = 0; k < planes.size() * angles.size(); k += step)
    directions.push_back(
        Direction(PhotometryType::kC, planes[k / angles.size()], angles[k % angles.size()]));
  return {"light field in the table's directions",
          static_cast<int>(directions.size()),
          LargestError(read, fields, distance_m, directions, FindPeak(written.table).intensity_cd),
          0,
          kDigits,
          0,
          0};
}

ExportCheck CheckInterpolation(const std::filesystem::path& path, const FarField& written,
                               std::span<const PosedLightField> fields,
                               std::optional<double> distance_m, std::uint64_t seed) {
  constexpr int kReceivers = 500;
  const Photometry read = ReadPhotometry(path);
  const Photometry& table = written.table;
  const double peak = FindPeak(table).intensity_cd;
  const std::vector<Cell> cells = LitCells(table, 1e-3 * peak);
  core::Random random(seed, 0x6469726563746E73);
  std::vector<Vec3> directions;
  for (int k = 0; k < kReceivers; ++k) {
    const Cell& cell = cells[static_cast<std::size_t>(random.Uniform() * double(cells.size()))];
    const double plane = std::lerp(cell.plane_from, cell.plane_to, random.Uniform());
    const double angle = std::lerp(cell.angle_from, cell.angle_to, random.Uniform());
    directions.push_back(Direction(PhotometryType::kC, plane, angle));
  }
  return {"light field between the table's directions", kReceivers,
          LargestError(read, fields, distance_m, directions, peak), 0,
          written.interpolation_error() + kDigits};
}

}  // namespace luxfield::formats
