#include "reconstruct/import_rays.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "reconstruct/gram_solve.h"
#include "reconstruct/non_negative.h"
#include "reconstruct/report.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisGrid;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Ray;
using lightfield::RayFile;
using lightfield::Vec2;
using lightfield::Vec3;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Linear Rec. 709 from XYZ (primaries and white of ITU-R BT.709).
std::array<double, 3> RgbFromXyz(const std::array<double, 3>& xyz) {
  return {3.2409699 * xyz[0] - 1.5373832 * xyz[1] - 0.4986108 * xyz[2],
          -0.9692436 * xyz[0] + 1.8759675 * xyz[1] + 0.0415551 * xyz[2],
          0.0556301 * xyz[0] - 0.2039770 * xyz[1] + 1.0569715 * xyz[2]};
}

// A forward ray as a line: crossing(z) = at_zero + z slope.
struct Line {
  Vec2 at_zero, slope;
  double flux = 0, cosine = 0;
  std::size_t ray = 0;

  Vec2 At(double z) const { return at_zero + z * slope; }
};

bool GoesForward(const Ray& ray, const LuminaireFromFile& pose) {
  return pose.Direction(ray.direction).z > 0;
}

std::vector<Line> ForwardLines(const RayFile& file, const LuminaireFromFile& pose) {
  std::vector<Line> lines;
  for (std::size_t n = 0; n < file.rays.size(); ++n) {
    const Vec3 p = pose.Point(file.rays[n].position_m), d = pose.Direction(file.rays[n].direction);
    if (!GoesForward(file.rays[n], pose)) continue;
    const Vec2 slope{d.x / d.z, d.y / d.z};
    lines.push_back({Vec2{p.x, p.y} - p.z * slope, slope, file.rays[n].flux, d.z / Length(d), n});
  }
  return lines;
}

double NarrowestZ(const std::vector<Line>& lines) {
  double weight = 0;
  Vec2 a, m;
  const auto w = [](const Line& line) { return line.flux * std::pow(line.cosine, 4); };
  for (const Line& line : lines) {
    weight += w(line);
    a = a + w(line) * line.at_zero;
    m = m + w(line) * line.slope;
  }
  if (!(weight > 0)) return 0;
  a = (1 / weight) * a;
  m = (1 / weight) * m;
  double covariance = 0, variance = 0;
  for (const Line& line : lines) {
    const Vec2 da = line.at_zero - a, dm = line.slope - m;
    covariance += w(line) * (da.x * dm.x + da.y * dm.y);
    variance += w(line) * (dm.x * dm.x + dm.y * dm.y);
  }
  // Parallel light is as narrow everywhere; 0 - x leaves no negative zero.
  return variance > 1e-12 * weight ? 0 - covariance / variance : 0;
}

struct Window {
  double low = 0, high = 0;
  double size() const { return high - low; }
  double middle() const { return (low + high) / 2; }
};

// The interval between the flux quantiles `outside` and 1 - `outside`.
template <typename Coordinate>
Window FluxWindow(const std::vector<Line>& lines, double outside, Coordinate&& coordinate) {
  std::vector<std::pair<double, double>> sorted;
  double total = 0;
  for (const Line& line : lines) {
    sorted.emplace_back(coordinate(line), line.flux);
    total += line.flux;
  }
  std::sort(sorted.begin(), sorted.end());
  Window window{sorted.front().first, sorted.back().first};
  double sum = 0;
  bool below = true;
  for (const auto& [x, flux] : sorted) {
    sum += flux;
    if (below && sum >= outside * total) {
      window.low = x;
      below = false;
    }
    if (sum >= (1 - outside) * total) {
      window.high = x;
      break;
    }
  }
  return window;
}

// Where the basis functions sum to 1.
Window InnerCells(const BasisGrid& grid, int count, double start_m) {
  return {start_m + (grid.basis.cells - 1) * grid.spacing_m, start_m + count * grid.spacing_m};
}

void CheckPose(const LuminaireFromFile& pose) {
  const Eigen::Map<const RowMatrix> r(pose.rotation.data(), 3, 3);
  if (!r.allFinite() || !(r * r.transpose()).isIdentity(1e-6) || !(r.determinant() > 0))
    throw InputError(
        "the rotation of luminaire_from_file is not a right-handed rotation; give three "
        "orthonormal rows");
  const Vec3 t = pose.translation_m;
  if (!std::isfinite(t.x + t.y + t.z))
    throw InputError("the translation of luminaire_from_file is not finite");
}

void CheckInnerCells(const BasisGrid& grid, int margin) {
  const int least = grid.basis.cells + 2 * margin;
  if (grid.width < least || grid.height < least)
    throw InputError(fmt::format(
        "a grid of {} x {} `{}` functions has too few inner cells; use at least {} each way",
        grid.width, grid.height, grid.basis.name(), least));
}

// Rays of every texel, in the file's order.
struct Hit {
  Vec2 u;
  std::size_t ray;
};

struct Bins {
  std::vector<std::size_t> first;  // of each texel, and the end
  std::vector<Hit> hits;
};

Bins BinRays(const std::vector<Line>& lines, const LuminaireGeometry& geometry, double filter_z_m,
             double scale, RayImportReport* report) {
  const auto& lattice = geometry.lattice;
  const Window u_window = InnerCells(geometry.grid, geometry.grid.width, geometry.grid.u0_m);
  const Window v_window = InnerCells(geometry.grid, geometry.grid.height, geometry.grid.v0_m);
  const auto inside = [](const Window& window, double x) {
    return x >= window.low && x <= window.high;
  };
  constexpr std::size_t kMissed = static_cast<std::size_t>(-1);
  std::vector<std::size_t> texel(lines.size(), kMissed);
  Bins bins;
  bins.first.assign(geometry.plane_size() + 1, 0);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const Vec2 u = lines[n].At(filter_z_m), s = lines[n].At(filter_z_m + geometry.delta_m);
    const double column = std::floor(lattice.column_of_s(s.x)),
                 row = std::floor(lattice.row_of_t(s.y));
    RayTally* tally = &report->used;
    if (!inside(u_window, u.x) || !inside(v_window, u.y))
      tally = &report->missed_filter_plane;
    else if (!(column >= 0 && column < lattice.width && row >= 0 && row < lattice.height))
      tally = &report->missed_image_plane;
    else
      ++bins.first[(texel[n] = static_cast<std::size_t>(row) * lattice.width +
                               static_cast<std::size_t>(column)) +
                   1];
    ++tally->rays;
    tally->flux += scale * lines[n].flux;
  }
  for (std::size_t t = 1; t < bins.first.size(); ++t) bins.first[t] += bins.first[t - 1];
  bins.hits.resize(bins.first.back());
  std::vector<std::size_t> next(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t n = 0; n < lines.size(); ++n)
    if (texel[n] != kMissed) bins.hits[next[texel[n]]++] = {lines[n].At(filter_z_m), lines[n].ray};
  return bins;
}

// Basis functions of one axis at x.
Eigen::VectorXd BasisValues(const lightfield::Basis& basis, double x, int count) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(count);
  const int cell = static_cast<int>(std::floor(x));
  for (int i = std::max(0, cell - basis.cells); i <= std::min(count - 1, cell); ++i)
    values(i) = basis.Value(x - i);
  return values;
}

// Least squares per texel, scaled to the texel's flux.
void Fit(const RayFile& file, const Bins& bins, double scale, const GramSolver& solver,
         RayImport* result) {
  LightField &c = result->coefficients, &sigma = result->sigma;
  const auto& geometry = c.geometry;
  const auto& grid = geometry.grid;
  const std::size_t texels = geometry.plane_size();
  const double area = geometry.lattice.texel_area_m2();
  const Eigen::Map<const RowMatrix> inverse_u(solver.u().inverse.data(), grid.width, grid.width);
  const Eigen::Map<const RowMatrix> inverse_v(solver.v().inverse.data(), grid.height, grid.height);
  // Flux of the fit of one ray of flux 1 at (u, v): the product of gain . phi over both axes; 1 in
  // the middle of a large grid.
  const double integral_m = grid.basis.TotalIntegral() * grid.spacing_m;
  const Eigen::VectorXd gain_u = integral_m * inverse_u.rowwise().sum();
  const Eigen::VectorXd gain_v = integral_m * inverse_v.rowwise().sum();
  core::ParallelFor(texels, 64, [&](std::size_t begin, std::size_t end) {
    std::vector<RowMatrix> e(geometry.channels), variance(geometry.channels);
    for (std::size_t texel = begin; texel < end; ++texel) {
      if (bins.first[texel] == bins.first[texel + 1]) continue;
      for (int channel = 0; channel < geometry.channels; ++channel)
        e[channel] = variance[channel] = RowMatrix::Zero(grid.height, grid.width);
      double flux_in = 0, flux_fitted = 0;
      for (std::size_t h = bins.first[texel]; h < bins.first[texel + 1]; ++h) {
        const Ray& ray = file.rays[bins.hits[h].ray];
        const Vec2 u = bins.hits[h].u;
        const Eigen::VectorXd phi_u =
            BasisValues(grid.basis, (u.x - grid.u0_m) / grid.spacing_m, grid.width);
        const Eigen::VectorXd phi_v =
            BasisValues(grid.basis, (u.y - grid.v0_m) / grid.spacing_m, grid.height);
        const RowMatrix phi = phi_v * phi_u.transpose();
        flux_in += ray.flux;
        flux_fitted += ray.flux * gain_u.dot(phi_u) * gain_v.dot(phi_v);
        const RowMatrix dual =
            (inverse_v * phi_v).cwiseAbs2() * (inverse_u * phi_u).cwiseAbs2().transpose();
        const std::array<double, 3> flux = geometry.channels == 3
                                               ? RgbFromXyz(*ray.tristimulus)
                                               : std::array<double, 3>{ray.flux, 0, 0};
        for (int channel = 0; channel < geometry.channels; ++channel) {
          const double scaled = scale * flux[channel];
          e[channel] += scaled / area * phi;
          variance[channel] += scaled * scaled / (area * area) * dual;
        }
      }
      const double correction = flux_fitted > 0 ? flux_in / flux_fitted : 1;
      for (int channel = 0; channel < geometry.channels; ++channel) {
        const RowMatrix solved = inverse_v * e[channel] * inverse_u;
        for (int m = 0; m < grid.count(); ++m) {
          c.image(m, channel)[texel] = static_cast<float>(correction * solved.data()[m]);
          sigma.image(m, channel)[texel] =
              static_cast<float>(correction * std::sqrt(variance[channel].data()[m]));
        }
      }
    }
  });
}

bool HasTristimulus(const RayFile& file) {
  return !file.rays.empty() && std::all_of(file.rays.begin(), file.rays.end(), [](const Ray& ray) {
    return ray.tristimulus.has_value();
  });
}

}  // namespace

Vec3 LuminaireFromFile::Direction(Vec3 d) const {
  const auto& r = rotation;
  return {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z,
          r[6] * d.x + r[7] * d.y + r[8] * d.z};
}

ChosenPlanes ChoosePlanes(const RayFile& file, const ImportRaysOptions& options) {
  CheckPose(options.luminaire_from_file);
  if (!(options.coverage > 0 && options.coverage < 1))
    throw InputError(fmt::format("coverage {} must lie between 0 and 1", options.coverage));
  const std::vector<Line> lines = ForwardLines(file, options.luminaire_from_file);
  double flux = 0;
  for (const Line& line : lines) flux += line.flux;
  if (!(flux > 0))
    throw InputError(
        "no ray with flux travels towards +z of the luminaire; turn the file with its pose");

  ChosenPlanes planes;
  planes.filter_z_m = options.filter_z_m ? *options.filter_z_m : NarrowestZ(lines);
  auto& geometry = planes.geometry;
  auto& grid = geometry.grid;
  grid.basis = options.basis;
  grid.width = options.grid_width;
  grid.height = options.grid_height;
  constexpr int kMargin = 1;  // inner cells left dark on each side, for the fit to ring in
  CheckInnerCells(grid, kMargin);

  const double outside = (1 - options.coverage) / 8;  // two planes, two axes, two sides
  const auto u =
      FluxWindow(lines, outside, [&](const Line& l) { return l.At(planes.filter_z_m).x; });
  const auto v =
      FluxWindow(lines, outside, [&](const Line& l) { return l.At(planes.filter_z_m).y; });
  const double extent = std::max(u.size(), v.size());
  constexpr double kPointDelta_m = 0.1,
                   kLeastSpacing = 0.005;  // of delta: a point needs some width
  geometry.delta_m = options.delta_m                 ? *options.delta_m
                     : extent > 1e-3 * kPointDelta_m ? 2 * extent
                                                     : kPointDelta_m;
  const auto inner = [&](int count) { return count - (grid.basis.cells - 1) - 2 * kMargin; };
  grid.spacing_m = std::max({u.size() / inner(grid.width), v.size() / inner(grid.height),
                             kLeastSpacing * geometry.delta_m});
  grid.u0_m = u.middle() - (grid.width + grid.basis.cells - 1) * grid.spacing_m / 2;
  grid.v0_m = v.middle() - (grid.height + grid.basis.cells - 1) * grid.spacing_m / 2;

  const double image_z_m = planes.filter_z_m + geometry.delta_m;
  Window s = FluxWindow(lines, outside, [&](const Line& l) { return l.At(image_z_m).x; });
  Window t = FluxWindow(lines, outside, [&](const Line& l) { return l.At(image_z_m).y; });
  for (Window* window :
       {&s, &t}) {  // the outermost rays lie inside, and a pencil of rays has some width
    const double half = std::max(window->size() * (0.5 + 1e-6), grid.spacing_m);
    *window = {window->middle() - half, window->middle() + half};
  }
  geometry.lattice = {options.lattice_width,
                      options.lattice_height,
                      s.low,
                      t.high,
                      s.size() / options.lattice_width,
                      t.size() / options.lattice_height};
  geometry.channels = HasTristimulus(file) ? 3 : 1;
  geometry.unit =
      file.flux_is_luminous ? lightfield::FluxUnit::kLumen : lightfield::FluxUnit::kWatt;
  geometry.Validate("the planes chosen for the rays");
  return planes;
}

RayImport ImportRays(const RayFile& file, const ImportRaysOptions& options) {
  CheckPose(options.luminaire_from_file);
  LuminaireGeometry geometry;
  RayImport result;
  RayImportReport& report = result.report;
  if (options.geometry) {
    geometry = *options.geometry;
    geometry.channels = HasTristimulus(file) ? 3 : 1;
    geometry.unit =
        file.flux_is_luminous ? lightfield::FluxUnit::kLumen : lightfield::FluxUnit::kWatt;
    geometry.Validate("the planes for the rays");
    CheckInnerCells(geometry.grid, 0);
  } else {
    const ChosenPlanes planes = ChoosePlanes(file, options);
    geometry = planes.geometry;
    report.filter_z_m = planes.filter_z_m;
  }

  for (const Ray& ray : file.rays) report.ray_flux += ray.flux;
  report.header_flux =
      file.flux_is_luminous ? file.header.luminous_flux_lm : file.header.radiant_flux_w;
  if (report.header_flux && report.ray_flux > 0)
    report.scale = *report.header_flux / report.ray_flux;
  const std::vector<Line> lines = ForwardLines(file, options.luminaire_from_file);
  report.all = {file.rays.size(), report.scale * report.ray_flux};
  for (const Ray& ray : file.rays)
    if (!GoesForward(ray, options.luminaire_from_file)) {
      ++report.backward.rays;
      report.backward.flux += report.scale * ray.flux;
    }
  const Bins bins = BinRays(lines, geometry, report.filter_z_m, report.scale, &report);
  if (report.used.rays == 0)
    throw InputError(
        fmt::format("none of {} rays crosses both planes ({} travel backwards, {} miss the filter "
                    "plane's window, {} the image "
                    "plane's); change the pose or the planes",
                    report.all.rays, report.backward.rays, report.missed_filter_plane.rays,
                    report.missed_image_plane.rays));

  result.coefficients = LightField(geometry);
  result.sigma = LightField(geometry);
  const GramSolver solver(geometry.grid);
  Fit(file, bins, report.scale, solver, &result);
  report.negative_energy = Statistics(result.coefficients, result.sigma).negative_energy;
  if (options.non_negative) {
    std::vector<float*> images;
    images.reserve(static_cast<std::size_t>(geometry.grid.count()));
    for (int m = 0; m < geometry.grid.count(); ++m)
      images.push_back(result.coefficients.image(m, 0).data());
    ProjectNonNegative(solver, images.data(), geometry.plane_size() * geometry.channels);
  }
  const std::array<double, 3> flux = lightfield::TotalFlux(result.coefficients);
  report.fitted_flux =
      geometry.channels == 3 ? 0.2126 * flux[0] + 0.7152 * flux[1] + 0.0722 * flux[2] : flux[0];
  return result;
}

nlohmann::json ToJson(const RayImportReport& report) {
  const auto tally = [](const RayTally& t) {
    return nlohmann::json{{"rays", t.rays}, {"flux", t.flux}};
  };
  nlohmann::json json{{"ray_flux", report.ray_flux},
                      {"scale", report.scale},
                      {"all", tally(report.all)},
                      {"backward", tally(report.backward)},
                      {"missed_filter_plane", tally(report.missed_filter_plane)},
                      {"missed_image_plane", tally(report.missed_image_plane)},
                      {"used", tally(report.used)},
                      {"fitted_flux", report.fitted_flux},
                      {"negative_energy", report.negative_energy},
                      {"filter_z_m", report.filter_z_m}};
  if (report.header_flux) json["header_flux"] = *report.header_flux;
  return json;
}

}  // namespace luxfield::reconstruct
