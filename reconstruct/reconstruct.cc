#include "reconstruct/reconstruct.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "reconstruct/gram_solve.h"
#include "reconstruct/separable_product.h"

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

struct Pointers {
  std::vector<const float*> irradiance, sigma;
  std::vector<const std::uint32_t*> mask;
  std::vector<float*> coefficients, coefficient_sigma;
};

// sigma(C) of complete pixels: variances through the squared inverse matrices.
void PropagateSigma(const GramSolver& solver, const Pointers& images, std::size_t values) {
  using Product = SeparableProduct<float>;
  const int width = solver.u().count, height = solver.v().count;
  // Scaled by h^2-like factors so that squares of very small or large physical values stay inside
  // float32's range: the largest sigma of each block of pixels becomes 1.
  std::vector<double> squared_u, squared_v;
  for (const double x : solver.u().inverse) squared_u.push_back(x * x);
  for (const double x : solver.v().inverse) squared_v.push_back(x * x);
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
      float largest = 0;
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          largest = std::max(largest, images.sigma[m][first + k]);
      const float reciprocal = largest > 0 ? 1 / largest : 0;
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k) {
          const float x = images.sigma[m][first + k] * reciprocal;
          in[m * Product::kLanes + k] = x * x;
        }
      product.Apply(in.data(), scratch.data(), out.data());
      for (std::size_t m = 0; m < images.sigma.size(); ++m)
        for (std::size_t k = 0; k < lanes; ++k)
          images.coefficient_sigma[m][first + k] =
              static_cast<float>(std::sqrt(out[m * Product::kLanes + k]) * (largest * root_scale));
    }
  });
}

void CountFlags(const Measurements& measurements, Reconstruction* result) {
  const std::size_t texels = measurements.geometry.plane_size();
  result->unknown_positions.assign(texels, 0);
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

void SolveBasis(const Measurements& measurements, const ReconstructOptions& options,
                const Pointers& images, Reconstruction* result) {
  const auto& geometry = measurements.geometry;
  const std::size_t texels = geometry.plane_size(), values = texels * geometry.channels;
  const GramSolver solver(geometry.grid);
  const double h2 = geometry.grid.spacing_m * geometry.grid.spacing_m;
  result->report.condition = solver.condition();
  result->report.noise_gain = solver.noise_gain() * h2;
  result->report.worst_gain = solver.worst_gain() * h2;
  if (options.precision == Precision::kDouble)
    solver.Solve<float, double>(images.irradiance.data(), images.coefficients.data(), values);
  else
    solver.Solve<float, float>(images.irradiance.data(), images.coefficients.data(), values);
  PropagateSigma(solver, images, values);

  std::vector<std::vector<std::uint32_t>> unknown_store;
  std::vector<const std::uint32_t*> unknown = images.mask;
  for (std::size_t m = 0; m < unknown.size(); ++m) {
    std::vector<std::uint32_t>& bits = unknown_store.emplace_back(measurements.positions[m].mask);
    for (std::uint32_t& mask : bits) mask &= lightfield::kUnknownMask;
    unknown[m] = bits.data();
  }
  result->report.incomplete = SolveIncomplete(
      solver, unknown.data(), texels, geometry.channels, images.irradiance.data(),
      images.sigma.data(), images.coefficients.data(), images.coefficient_sigma.data());
  result->report.coefficients = Statistics(result->coefficients, result->sigma);
  if (options.non_negative)
    result->report.non_negative = ProjectNonNegative(solver, images.coefficients.data(), values);
}

void SolveDual(const Measurements& measurements, const ReconstructOptions& options,
               Reconstruction* result) {
  if (options.non_negative)
    throw InputError(
        "--non-negative: dual filters need no solve that could be constrained; merge a session "
        "taken with `basis` "
        "filters, or clamp the coefficients where they are used");
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
  for (const std::uint16_t unknown : result->unknown_positions) {
    result->report.incomplete.incomplete += unknown > 0;
    result->report.incomplete.unknown += unknown == images;
  }
  result->report.coefficients = Statistics(result->coefficients, result->sigma);
}

}  // namespace

Reconstruction Reconstruct(const Measurements& measurements, const ReconstructOptions& options) {
  CheckShape(measurements);
  Reconstruction result;
  result.coefficients = LightField(measurements.geometry);
  result.coefficients.provenance = measurements.provenance;
  result.sigma = result.coefficients;
  result.report.images = measurements.geometry.grid.count();
  CountFlags(measurements, &result);
  if (measurements.filter == FilterKind::kDual) {
    SolveDual(measurements, options, &result);
    return result;
  }
  Pointers images;
  for (int m = 0; m < measurements.geometry.grid.count(); ++m) {
    const Measurement& position = measurements.positions[m];
    images.irradiance.push_back(position.irradiance.data());
    images.sigma.push_back(position.sigma.data());
    images.mask.push_back(position.mask.data());
    images.coefficients.push_back(result.coefficients.image(m, 0).data());
    images.coefficient_sigma.push_back(result.sigma.image(m, 0).data());
  }
  SolveBasis(measurements, options, images, &result);
  return result;
}

}  // namespace luxfield::reconstruct
