#include "luxfield/lightfield/projected_texels.h"

#include <algorithm>
#include <cmath>

#include "luxfield/lightfield/quadrature.h"

namespace luxfield::lightfield {

PencilAxis PencilAxis::ThroughPoint(double p_m, double z_m, double delta_m) {
  const double distance = z_m - delta_m;
  // Near the luminaire u - p is the small quantity and p is of the luminaire's size; far away p may
  // be a million times the luminaire, but p delta / D is not.
  if (distance < delta_m) return {p_m, p_m, distance / z_m, 0};
  const double u_pivot = -p_m * (delta_m / distance);
  return {0, u_pivot, distance / z_m, u_pivot - p_m};
}

ProjectedTexels ProjectTexels(const Basis& basis, double u0_m, double spacing_m, int i,
                              const TexelAxis& texels, const PencilAxis& pencil) {
  const double w_start = u0_m + i * spacing_m - pencil.u_pivot_m;
  const double w_end = u0_m + (i + basis.cells) * spacing_m - pencil.u_pivot_m;
  const auto texel_of_w = [&](double w) {
    const double s = pencil.s_pivot_m + w * pencil.s_per_w;
    return std::floor((s - texels.origin_m) / texels.step_m);
  };
  // w of the border before texel k; only asked for where the window crosses it, so s_per_w != 0.
  const auto border = [&](double k) {
    const double w = ((texels.origin_m - pencil.s_pivot_m) + k * texels.step_m) / pencil.s_per_w;
    return std::clamp(w, w_start, w_end);
  };

  ProjectedTexels out;
  const double q_start = texel_of_w(w_start), q_end = texel_of_w(w_end);
  const double q_lowest = std::min(q_start, q_end), q_highest = std::max(q_start, q_end);
  const double begin = std::max(q_lowest, 0.0), last = std::min(q_highest, texels.count - 1.0);
  if (!(begin <= last)) return out;

  out.first = static_cast<int>(begin);
  const auto size = static_cast<std::size_t>(last - begin) + 1;
  out.zeroth.resize(size);
  out.moment.resize(size);
  out.w_lo.resize(size);
  out.w_hi.resize(size);
  const bool ascending = q_start <= q_end;  // does w grow with the texel index?
  for (std::size_t k = 0; k < size; ++k) {
    const double q = begin + static_cast<double>(k);
    const double before = q == q_lowest ? (ascending ? w_start : w_end) : border(q);
    const double after = q == q_highest ? (ascending ? w_end : w_start) : border(q + 1);
    const double lo = std::min(before, after), hi = std::max(before, after);
    out.w_lo[k] = lo;
    out.w_hi[k] = hi;
    for (int cell = 0; cell < basis.cells; ++cell) {
      const double knot = w_start + cell * spacing_m;
      const double a = std::max(lo, knot), b = std::min(hi, knot + spacing_m);
      if (!(a < b)) continue;
      out.zeroth[k] +=
          Gauss2(a, b, [&](double w) { return basis.CellValue(cell, (w - knot) / spacing_m); });
      out.moment[k] += Gauss2(a, b, [&](double w) {
        return (w + pencil.moment_offset_m) * basis.CellValue(cell, (w - knot) / spacing_m);
      });
    }
  }
  return out;
}

std::vector<ProjectedTexels> ProjectAllTexels(const Basis& basis, double u0_m, double spacing_m,
                                              int count, const TexelAxis& texels,
                                              const PencilAxis& pencil) {
  std::vector<ProjectedTexels> all;
  all.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    all.push_back(ProjectTexels(basis, u0_m, spacing_m, i, texels, pencil));
  return all;
}

TwoSums WeightedSums(std::span<const float> values, std::span<const double> a,
                     std::span<const double> b) {
  // Four independent chains hide the latency of the additions.
  constexpr std::size_t kLanes = 4;
  double sum_a[kLanes] = {}, sum_b[kLanes] = {};
  std::size_t k = 0;
  for (; k + kLanes <= values.size(); k += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const double value = values[k + lane];
      sum_a[lane] += value * a[k + lane];
      sum_b[lane] += value * b[k + lane];
    }
  for (; k < values.size(); ++k) {
    sum_a[0] += values[k] * a[k];
    sum_b[0] += values[k] * b[k];
  }
  return {(sum_a[0] + sum_a[1]) + (sum_a[2] + sum_a[3]),
          (sum_b[0] + sum_b[1]) + (sum_b[2] + sum_b[3])};
}

}  // namespace luxfield::lightfield
