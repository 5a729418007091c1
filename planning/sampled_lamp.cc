#include "luxfield/planning/sampled_lamp.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"

namespace luxfield::planning {
namespace {

using lightfield::Dot;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Receiver;

// radiance(ix, iy, u, s) of the cell's middle u and where its line to the receiver meets I.
template <typename Radiance>
std::vector<double> Integrate(double delta_m, Vec2 corner, Vec2 cell, int cells_u, int cells_v,
                              const std::vector<Receiver>& receivers, const Radiance& radiance) {
  std::vector<double> irradiance(receivers.size(), 0.0);
  core::ParallelFor(receivers.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto& [p, n] = receivers[k];
      if (!(p.z > 0)) continue;
      double sum = 0;
      for (int y = 0; y < cells_v; ++y)
        for (int x = 0; x < cells_u; ++x) {
          const Vec2 u{corner.x + (x + 0.5) * cell.x, corner.y + (y + 0.5) * cell.y};
          const Vec3 way = Vec3{u.x, u.y, 0} - p;
          const double towards = Dot(n, way);
          if (!(towards > 0)) continue;
          const double k_s = delta_m / p.z, r2 = Dot(way, way);
          const Vec2 s{u.x - k_s * way.x, u.y - k_s * way.y};
          sum += radiance(x, y, u, s) * towards * p.z / (r2 * r2);
        }
      irradiance[k] = sum * cell.x * cell.y;
    }
  });
  return irradiance;
}

}  // namespace

Rectangle LitRectangle(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& search,
                       const lightfield::Lattice& lattice) {
  constexpr int kCells = 64, kPoints = 48;
  const double du = (search.x1 - search.x0) / kCells, dv = (search.y1 - search.y0) / kCells;
  std::vector<double> s(kPoints), radiance(static_cast<std::size_t>(kPoints) * 3);
  for (int k = 0; k < kPoints; ++k) s[k] = lattice.s_of_column((k + 0.5) * lattice.width / kPoints);
  int x0 = kCells, x1 = 0, y0 = kCells, y1 = 0;
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const Vec2 u{search.x0 + (x + 0.5) * du, search.y0 + (y + 0.5) * dv};
      if (lamp.DarkAt(u)) continue;
      bool lit = false;
      for (int row = 0; row < kPoints && !lit; ++row) {
        lamp.Radiance(u, delta_m, lattice.t_of_row((row + 0.5) * lattice.height / kPoints), s,
                      radiance);
        lit = std::any_of(radiance.begin(), radiance.begin() + kPoints,
                          [](double value) { return value > 0; });
      }
      if (!lit) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
    }
  if (x0 >= x1)
    throw InputError(
        "the lamp sends no light from about the stage's reach to what the scene shows; "
        "turn the scene's luminaire to it");
  x0 = std::max(x0 - 1, 0), x1 = std::min(x1 + 1, kCells);
  y0 = std::max(y0 - 1, 0), y1 = std::min(y1 + 1, kCells);
  return {search.x0 + x0 * du, search.x0 + x1 * du, search.y0 + y0 * dv, search.y0 + y1 * dv};
}

std::vector<double> LampIrradiance(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& lit,
                                   const std::vector<Receiver>& receivers, int nodes) {
  return Integrate(delta_m, {lit.x0, lit.y0},
                   {(lit.x1 - lit.x0) / nodes, (lit.y1 - lit.y0) / nodes}, nodes, nodes, receivers,
                   [&](int, int, Vec2 u, Vec2 s) {
                     double radiance[3] = {};  // of as many channels as the lamp traces
                     if (!lamp.DarkAt(u))
                       lamp.Radiance(u, delta_m, s.y, std::span<const double>(&s.x, 1),
                                     std::span(radiance, lamp.traced_channels()));
                     return radiance[0] * lamp.channel_factor(0);
                   });
}

SampledLamp SampleLamp(const hal::sim::Lamp& lamp, double delta_m, const Rectangle& lit, int cells,
                       const lightfield::Lattice& lattice) {
  SampledLamp samples;
  samples.delta_m = delta_m;
  samples.lit = lit;
  samples.lattice = lattice;
  samples.cell_m = std::max(lit.x1 - lit.x0, lit.y1 - lit.y0) / cells;
  const auto along = [&](double length) {
    return static_cast<int>(std::ceil(length / samples.cell_m - 1e-9));
  };
  samples.cells_u = along(lit.x1 - lit.x0);
  samples.cells_v = along(lit.y1 - lit.y0);
  const std::size_t per_texel = static_cast<std::size_t>(samples.cells_u) * samples.cells_v;
  samples.flux_density.assign(per_texel * lattice.width * lattice.height, 0.0f);
  core::Progress progress("lamp", static_cast<std::uint64_t>(lattice.height));
  core::ParallelFor(
      static_cast<std::size_t>(lattice.height), 1, [&](std::size_t begin, std::size_t end) {
        const auto width = static_cast<std::size_t>(lattice.width);
        std::vector<double> s(width), radiance(width * lamp.traced_channels());
        for (std::size_t k = 0; k < width; ++k)
          s[k] = lattice.s_of_column(static_cast<double>(k) + 0.5);
        const double delta2 = delta_m * delta_m, factor = lamp.channel_factor(0) * delta2;
        for (std::size_t row = begin; row < end; ++row) {
          core::ThrowIfInterrupted();
          const double t = lattice.t_of_row(static_cast<double>(row) + 0.5);
          float* texels = samples.flux_density.data() + row * width * per_texel;
          for (std::size_t cell = 0; cell < per_texel; ++cell) {
            const Vec2 u{
                lit.x0 + (static_cast<double>(cell % samples.cells_u) + 0.5) * samples.cell_m,
                lit.y0 + (static_cast<double>(cell / samples.cells_u) + 0.5) * samples.cell_m};
            if (lamp.DarkAt(u)) continue;
            lamp.Radiance(u, delta_m, t, s, radiance);
            for (std::size_t k = 0; k < width; ++k) {
              const double dx = s[k] - u.x, dy = t - u.y, r2 = delta2 + dx * dx + dy * dy;
              texels[k * per_texel + cell] = static_cast<float>(radiance[k] * factor / (r2 * r2));
            }
          }
          progress.Advance();
        }
      });
  return samples;
}

std::vector<double> SampledIrradiance(const SampledLamp& samples,
                                      const std::vector<Receiver>& receivers) {
  const auto& lattice = samples.lattice;
  const double delta2 = samples.delta_m * samples.delta_m;
  constexpr int kPoints = 4;  // per cell and axis: the cell's line ends in several texels
  const double step = samples.cell_m / kPoints;
  return Integrate(
      samples.delta_m, {samples.lit.x0, samples.lit.y0}, {step, step}, kPoints * samples.cells_u,
      kPoints * samples.cells_v, receivers, [&](int x, int y, Vec2 u, Vec2 s) {
        const double column = std::floor(lattice.column_of_s(s.x)),
                     row = std::floor(lattice.row_of_t(s.y));
        if (!(column >= 0 && column < lattice.width && row >= 0 && row < lattice.height))
          return 0.0;
        const double dx = s.x - u.x, dy = s.y - u.y, r2 = delta2 + dx * dx + dy * dy;
        const auto texel = static_cast<std::size_t>(row * lattice.width + column);
        return samples.of_texel(texel)[y / kPoints * samples.cells_u + x / kPoints] * r2 * r2 /
               delta2;
      });
}

}  // namespace luxfield::planning
