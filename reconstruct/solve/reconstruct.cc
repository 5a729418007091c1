#include "luxfield/reconstruct/solve/reconstruct.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/general_solve.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/irradiance_metric.h"
#include "luxfield/reconstruct/solve/moment_constraint.h"
#include "luxfield/reconstruct/solve/non_negative_rows.h"
#include "luxfield/reconstruct/solve/reconstruct_rows.h"
#include "luxfield/reconstruct/solve/separable_product.h"
#include "luxfield/reconstruct/solve/unknown_texels.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::FilterKind;
using lightfield::LightField;
using lightfield::Measurement;
using lightfield::Measurements;

void CheckShape(const Measurements& measurements) {
  const auto& geometry = measurements.geometry;
  geometry.Validate("measurements");
  const std::size_t images = static_cast<std::size_t>(geometry.grid.count());
  if (measurements.positions.size() != images)
    throw InputError(fmt::format(
        "measurements: {} filter positions for a grid of {} x {}; merge the session again",
        measurements.positions.size(), geometry.grid.width, geometry.grid.height));
  const std::size_t texels = geometry.plane_size(), values = texels * geometry.channels;
  for (std::size_t m = 0; m < images; ++m) {
    const Measurement& position = measurements.positions[m];
    if (position.irradiance.size() != values || position.sigma.size() != values ||
        position.mask.size() != texels)
      throw InputError(
          fmt::format("measurements: position {} does not have the size of the lattice; merge the "
                      "session again",
                      m));
  }
}

// Measurements that can be solved together.
void CheckTogether(std::span<const Measurements> all, const ReconstructOptions& options) {
  if (all.empty()) throw InputError("no measurements to reconstruct from; name a .meas.exr");
  for (const Measurements& measurements : all) {
    CheckShape(measurements);
    if (!(measurements.geometry == all[0].geometry) || measurements.filter != all[0].filter)
      throw InputError(
          "measurements of different geometries or filters cannot be solved together; capture them "
          "with one plan");
    if (!options.filter) continue;
    const auto& filter = *options.filter;
    if (filter.filter != measurements.filter ||
        std::abs(filter.filter_scale - measurements.filter_scale) > 1e-9 * filter.filter_scale)
      throw InputError(
          "measured filter",
          fmt::format("is {} of scale {}, the measurements were taken with {} of scale {}",
                      filter.filter == FilterKind::kDual ? "a dual pair" : "a basis print",
                      filter.filter_scale,
                      measurements.filter == FilterKind::kDual ? "a dual pair" : "a basis print",
                      measurements.filter_scale),
          "measure the filter that the session was taken with");
  }
}

struct Pointers {
  std::vector<const float*> irradiance, sigma;  // per measurement
  std::vector<std::vector<std::uint32_t>> unknown_store;
  std::vector<const std::uint32_t*> unknown;  // mask bits under which nothing is known
  std::vector<float*> coefficients, coefficient_sigma;

  // A mask that has no other bits is looked at where it is.
  void AddUnknown(const std::vector<std::uint32_t>& mask) {
    std::uint32_t bits = 0;
    for (const std::uint32_t each : mask) bits |= each;
    if (!(bits & ~lightfield::kUnknownMask)) {
      unknown.push_back(mask.data());
      return;
    }
    std::vector<std::uint32_t>& kept = unknown_store.emplace_back(mask);
    for (std::uint32_t& each : kept) each &= lightfield::kUnknownMask;
    unknown.push_back(kept.data());
  }

  PixelImages Images(const lightfield::LuminaireGeometry& geometry) const {
    return {geometry.plane_size(), geometry.channels, irradiance, sigma,
            coefficients,          coefficient_sigma};
  }
};

// sigma(C) of complete pixels: variances through the squared maps.
void PropagateSigma(const GramSolver& solver, const Pointers& images, std::size_t values) {
  using Product = SeparableProduct<float>;
  const int width = solver.u().count, height = solver.v().count;
  // Scaled by h^2-like factors so that squares of very small or large physical values stay inside
  // float32's range: the largest sigma of each pixel becomes 1.
  std::vector<double> squared_u, squared_v;
  for (const double x : solver.u().map) squared_u.push_back(x * x);
  for (const double x : solver.v().map) squared_v.push_back(x * x);
  double scale_u = 0, scale_v = 0;
  for (const double x : squared_u) scale_u = std::max(scale_u, x);
  for (const double x : squared_v) scale_v = std::max(scale_v, x);
  for (double& x : squared_u) x /= scale_u;
  for (double& x : squared_v) x /= scale_v;
  const double root_scale = std::sqrt(scale_u) * std::sqrt(scale_v);
  const Product product(squared_u, width, width, squared_v, height, height);

  core::ParallelFor(values, 8 * Product::kLanes, [&](std::size_t begin, std::size_t end) {
    std::vector<float> in(product.input_size()), scratch(product.scratch_size()),
        out(product.output_size());
    for (std::size_t first = begin; first < end; first += Product::kLanes) {
      const std::size_t lanes = std::min(Product::kLanes, end - first);
      std::array<float, Product::kLanes> largest{}, reciprocal{};
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          largest[k] = std::max(largest[k], images.sigma[m][first + k]);
      for (std::size_t k = 0; k < lanes; ++k) reciprocal[k] = largest[k] > 0 ? 1 / largest[k] : 0;
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k) {
          const float x = images.sigma[m][first + k] * reciprocal[k];
          in[m * Product::kLanes + k] = x * x;
        }
      product.Apply(in.data(), scratch.data(), out.data());
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          images.coefficient_sigma[m][first + k] = static_cast<float>(
              std::sqrt(out[m * Product::kLanes + k]) * (largest[k] * root_scale));
    }
  });
}

void CountFlags(const Measurements& measurements, Reconstruction* result) {
  const std::size_t texels = measurements.geometry.plane_size();
  for (const Measurement& position : measurements.positions)
    for (std::size_t p = 0; p < texels; ++p) {
      const std::uint32_t mask = position.mask[p];
      if (mask == 0) continue;
      if (mask & lightfield::kUnknownMask) ++result->unknown_positions[p];
      result->report.off_sensor += (mask & lightfield::kOffSensor) != 0;
      result->report.saturated += (mask & lightfield::kSaturated) != 0;
      result->report.too_dark += (mask & lightfield::kTooDark) != 0;
      result->report.defect += (mask & lightfield::kDefect) != 0;
    }
}

bool IsDisplaced(const Measurements& measurements) {
  return std::any_of(measurements.positions.begin(), measurements.positions.end(),
                     [](const Measurement& position) {
                       return position.displacement_m.x != 0 || position.displacement_m.y != 0;
                     });
}

void SolveBasis(const lightfield::LuminaireGeometry& geometry, const ReconstructOptions& options,
                const Pointers& images, Reconstruction* result) {
  result->report.kept = MomentsToKeep(geometry.grid, options.keep, *result->report.edges);
  const GramSolver solver(geometry.grid, result->report.kept);
  const std::size_t values = geometry.plane_size() * geometry.channels;
  const double h2 = geometry.grid.spacing_m * geometry.grid.spacing_m;
  result->report.solve = "gram";
  result->report.condition = solver.condition();
  result->report.noise_gain = solver.noise_gain() * h2;
  result->report.worst_gain = solver.worst_gain() * h2;
  if (options.precision == Precision::kDouble)
    solver.Solve<float, double>(images.irradiance.data(), images.coefficients.data(), values);
  else
    solver.Solve<float, float>(images.irradiance.data(), images.coefficients.data(), values);
  PropagateSigma(solver, images, values);
  result->report.incomplete =
      SolveIncomplete(GramSystem(solver), images.unknown, images.Images(geometry));
}

bool TakesForwardModel(std::span<const Measurements> all, const ReconstructOptions& options) {
  return all.size() > 1 || options.filter || options.regularise || IsDisplaced(all[0]);
}

void SolveForwardModel(std::span<const Measurements> all, const ReconstructOptions& options,
                       const WholeFigures& whole, const Pointers& images, Reconstruction* result) {
  const auto& geometry = all[0].geometry;
  const auto& grid = geometry.grid;
  std::vector<lightfield::Vec2> centres;
  for (const Measurements& measurements : all)
    for (int m = 0; m < grid.count(); ++m)
      centres.push_back(grid.centre(m % grid.width, m / grid.width) +
                        measurements.positions[m].displacement_m);
  const FilterSystem system(grid, options.filter, centres, all[0].filter);
  const double h2 = grid.spacing_m * grid.spacing_m;
  result->report.condition = system.condition();
  result->report.noise_gain = system.noise_gain() * h2;
  result->report.worst_gain = system.worst_gain() * h2;
  if (options.filter) result->report.filter_noise = system.matrix_noise();
  MomentConstraint kept;
  if (result->report.edges)
    kept = ConstrainMoments(system, grid, MomentsToKeep(grid, options.keep, *result->report.edges),
                            whole.position_noise);
  result->report.kept = {(kept.moments + 1) / 2, (kept.moments + 1) / 2};
  if (kept.moments > 0) result->report.moment_residual = kept.residual;
  const PixelImages pixels = images.Images(geometry);
  if (const auto separable = system.Separable(options.separable_tolerance)) {
    result->report.solve = "separable";
    result->report.incomplete = SolveIncomplete(*separable, images.unknown, pixels, true);
    if (kept.moments > 0) SolveKeeping(system, kept, images.unknown, pixels);
  } else {
    result->report.solve = "general";
    result->report.incomplete = SolveGeneral(system, images.unknown, pixels, kept);
  }
  if (options.regularise)
    result->report.regularisation =
        Regularise(system, grid, options.lambda, images.unknown, pixels, kept);
}

// How C came of E, for who wants to know how its errors hang together.
void NameSolve(Reconstruction* result) {
  const ReconstructionReport& report = result->report;
  for (LightField* field : {&result->coefficients, &result->sigma}) {
    field->provenance["solve"] = report.regularisation ? "regularised" : report.solve;
    field->provenance["kept_moments"] = fmt::format("{} {}", report.kept.u, report.kept.v);
  }
}

void SolveDual(const Measurements& measurements, const Pointers& all, Reconstruction* result) {
  result->report.solve = "none";
  result->report.condition = result->report.noise_gain = result->report.worst_gain = 1;
  const auto& geometry = measurements.geometry;
  const std::size_t texels = geometry.plane_size();
  const double scale = 1 / (geometry.grid.spacing_m * geometry.grid.spacing_m);
  const int images = geometry.grid.count();
  for (int m = 0; m < images; ++m) {
    const Measurement& position = measurements.positions[m];
    for (int channel = 0; channel < geometry.channels; ++channel) {
      const auto c = result->coefficients.image(m, channel),
                 sigma = result->sigma.image(m, channel);
      for (std::size_t p = 0; p < texels; ++p) {
        if (position.mask[p] & lightfield::kUnknownMask) continue;
        c[p] = static_cast<float>(position.irradiance[channel * texels + p] * scale);
        sigma[p] = static_cast<float>(position.sigma[channel * texels + p] * scale);
      }
    }
  }
  // An unknown coefficient is 0 give or take the pixel's others (the prior of pixel_weights.h).
  std::vector<std::uint32_t> nothing_known;
  for (std::size_t p = 0; p < texels; ++p) {
    const int unknown = result->unknown_positions[p];
    if (unknown == 0) continue;
    ++result->report.incomplete.incomplete;
    if (unknown == images) nothing_known.push_back(static_cast<std::uint32_t>(p));
    for (int channel = 0; channel < geometry.channels && unknown < images; ++channel) {
      double squares = 0;
      for (int m = 0; m < images; ++m) {
        const double c = result->coefficients.image(m, channel)[p];
        squares += c * c;
      }
      for (int m = 0; m < images; ++m)
        if (measurements.positions[m].mask[p] & lightfield::kUnknownMask)
          result->sigma.image(m, channel)[p] =
              static_cast<float>(std::sqrt(squares / (images - unknown)));
    }
  }
  result->report.incomplete.unknown = nothing_known.size();
  FillUnknown(nothing_known, all.Images(geometry));
}

// Per texel: whether nothing is known of it.
std::vector<bool> NothingKnown(const PixelImages& images, const Reconstruction& result) {
  std::vector<bool> nothing_known(images.pixels);
  for (std::size_t p = 0; p < images.pixels; ++p)
    nothing_known[p] = result.unknown_positions[p] == images.irradiance.size();
  return nothing_known;
}

// Sigma of texels of which nothing is known, from the C of all others; what it follows from.
std::vector<double> FillUnknownTexels(std::size_t width, const PixelImages& images,
                                      const Reconstruction& result) {
  std::vector<std::uint32_t> nothing_known;
  const std::vector<bool> is_one = NothingKnown(images, result);
  for (std::size_t p = 0; p < images.pixels; ++p)
    if (is_one[p]) nothing_known.push_back(static_cast<std::uint32_t>(p));
  std::vector<double> squares = RowSquares(nothing_known, width, images);
  FillUnknown(nothing_known, squares, images);
  return squares;
}

}  // namespace

void WholeFigureSums::Add(std::span<const Measurements> rows) {
  if (rows[0].filter == FilterKind::kBasis) {
    if (!edges_) edges_.emplace();
    edges_->Add(rows);
  }
  if (!TakesForwardModel(rows, options_)) return;
  std::size_t number = 0;
  for (const Measurements& measurements : rows) {
    const std::size_t texels = measurements.geometry.plane_size(),
                      width = static_cast<std::size_t>(measurements.geometry.lattice.width);
    noise_.resize(std::max(noise_.size(), number + measurements.positions.size()));
    for (const Measurement& position : measurements.positions) {
      Noise& noise = noise_[number++];
      for (std::size_t row = 0; row < texels; row += width) {
        double squares = 0;
        for (int channel = 0; channel < measurements.geometry.channels; ++channel)
          for (std::size_t p = row; p < row + width; ++p)
            if (!(position.mask[p] & lightfield::kUnknownMask)) {
              const double sigma = position.sigma[channel * texels + p];
              squares += sigma * sigma;
              ++noise.count;
            }
        noise.squares += squares;
      }
    }
  }
}

WholeFigures WholeFigureSums::Find() const {
  WholeFigures whole;
  if (edges_) whole.edges = edges_->Find();
  for (const Noise& noise : noise_)
    whole.position_noise.push_back(noise.count > 0 ? std::sqrt(noise.squares / noise.count) : 0);
  return whole;
}

WholeFigures FindWholeFigures(std::span<const Measurements> all,
                              const ReconstructOptions& options) {
  WholeFigureSums sums(options);
  sums.Add(all);
  return sums.Find();
}

namespace {

bool IsByIrradiance(const ReconstructOptions& options) {
  return options.non_negative && options.metric == NonNegativeMetric::kIrradiance;
}

// `of_whole` null: these are all rows.
RowsSolution Solve(std::span<const Measurements> all, const ReconstructOptions& options,
                   const WholeFigures* of_whole) {
  CheckTogether(all, options);
  if (options.regularise && options.non_negative)
    throw InputError(
        "--regularise with --non-negative: the bias of both together cannot be stated; ask for one "
        "of them");
  const auto& geometry = all[0].geometry;
  RowsSolution solution;
  Reconstruction& result = solution.rows;
  result.coefficients = LightField(geometry);
  result.coefficients.provenance = all[0].provenance;
  result.sigma = result.coefficients;
  result.report.images = geometry.grid.count();
  result.unknown_positions.assign(geometry.plane_size(), 0);
  for (const Measurements& measurements : all) CountFlags(measurements, &result);
  Pointers images;
  for (const Measurements& measurements : all)
    for (const Measurement& position : measurements.positions) {
      images.irradiance.push_back(position.irradiance.data());
      images.sigma.push_back(position.sigma.data());
      images.AddUnknown(position.mask);
    }
  for (int m = 0; m < geometry.grid.count(); ++m) {
    images.coefficients.push_back(result.coefficients.image(m, 0).data());
    images.coefficient_sigma.push_back(result.sigma.image(m, 0).data());
  }
  const WholeFigures whole = of_whole ? *of_whole : FindWholeFigures(all, options);
  if (whole.edges) {
    result.report.edges = whole.edges;
    result.report.warnings = EdgeWarnings(*whole.edges, geometry.grid);
  }
  if (TakesForwardModel(all, options))
    SolveForwardModel(all, options, whole, images, &result);
  else if (all[0].filter == FilterKind::kDual)
    SolveDual(all[0], images, &result);
  else
    SolveBasis(geometry, options, images, &result);
  const auto width = static_cast<std::size_t>(geometry.lattice.width);
  if (result.report.incomplete.unknown > 0 || of_whole)
    solution.row_squares = FillUnknownTexels(width, images.Images(geometry), result);
  if (of_whole) {
    solution.sums.Add(result.coefficients, result.sigma,
                      NothingKnown(images.Images(geometry), result));
    result.report.coefficients = solution.sums.Find();
  } else {
    result.report.coefficients = Statistics(result.coefficients, result.sigma);
  }
  NameSolve(&result);
  if (IsByIrradiance(options)) {
    result.report.non_negative = ProjectByIrradiance({}, &result.coefficients);
  } else if (options.non_negative) {
    NonNegativeOptions how;
    how.keep_first_moments = result.report.kept.u > 1 && result.report.kept.v > 1;
    result.report.non_negative =
        ProjectNonNegativeRows(GramSolver(geometry.grid), images.coefficients.data(),
                               geometry.plane_size() * geometry.channels, width, how);
  }
  return solution;
}

}  // namespace

Reconstruction Reconstruct(std::span<const Measurements> all, const ReconstructOptions& options) {
  return Solve(all, options, nullptr).rows;
}

RowsSolution ReconstructRows(std::span<const Measurements> rows, const ReconstructOptions& options,
                             const WholeFigures& whole) {
  if (options.regularise || IsByIrradiance(options))
    throw InputError(fmt::format(
        "{} takes sums over all texels and cannot be done for some rows alone; leave it out",
        options.regularise ? "--regularise" : "--non-negative-metric irradiance"));
  return Solve(rows, options, &whole);
}

Reconstruction Reconstruct(const Measurements& measurements, const ReconstructOptions& options) {
  return Reconstruct(std::span(&measurements, 1), options);
}

void StateProvenance(const ReconstructOptions& options, const SourceHashes& sources,
                     Reconstruction* result) {
  const std::string source = fmt::format("{}", fmt::join(sources.measurements, " "));
  auto& provenance = result->coefficients.provenance;
  provenance["measurements_sha256"] = source;
  provenance["non_negative"] = options.non_negative ? "yes" : "no";
  if (options.non_negative)
    provenance["non_negative_metric"] = NonNegativeMetricName(options.metric);
  provenance["keep"] = KeepName(options.keep);
  if (const auto& regularisation = result->report.regularisation)
    provenance["regularised"] = fmt::format("lambda {:.6g}, bias {:.3g} of the RMS of C",
                                            regularisation->lambda, regularisation->bias);
  if (!sources.filter.empty()) provenance["filter_sha256"] = sources.filter;
  result->sigma.provenance["sigma_of"] = source;
}

}  // namespace luxfield::reconstruct
