#include "luxfield/lightfield/edge_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "luxfield/core/simd.h"
#include "luxfield/lightfield/edge_light_json.h"
#include "luxfield/lightfield/edge_light_sums.h"

namespace luxfield::lightfield {

std::optional<double> LargestEdgeRatio(const Basis& basis) {
  switch (basis.kind) {
    case BasisKind::kBspline2:
      return 0.35;
    case BasisKind::kBilinear:
      return 0.5;
    case BasisKind::kBox:
    case BasisKind::kQuadratic:
      return {};
  }
  return {};
}

EdgeLight FindEdgeLight(const BasisGrid& grid, std::span<const double> light,
                        std::span<const double> variance) {
  constexpr double kSigmas = 3, kLeastShare = 1e-3;
  struct Row {
    double light = 0, variance = 0;
  };
  std::vector<Row> columns(grid.width), rows(grid.height);
  double whole = 0;
  for (int m = 0; m < grid.count(); ++m)
    for (Row* row : {&columns[m % grid.width], &rows[m / grid.width]}) {
      row->light += light[m];
      row->variance += variance[m];
    }
  for (const Row& row : rows) whole += row.light;

  const auto limit = LargestEdgeRatio(grid.basis);
  const auto side = [&](const char* name, const std::vector<Row>& across, bool last) {
    EdgeSide result{name};
    const auto count = across.size();
    if (count < 2) return result;
    const Row &outer = across[last ? count - 1 : 0], &next = across[last ? count - 2 : 1];
    if (next.light > 0) result.ratio = outer.light / next.light;
    if (whole > 0) result.share = outer.light / whole;
    if (!limit || count < static_cast<std::size_t>(grid.basis.cells)) return result;
    const double sigma = std::sqrt(outer.variance + *limit * *limit * next.variance);
    result.reached = result.share > kLeastShare &&
                     outer.light - *limit * std::max(next.light, 0.0) > kSigmas * sigma;
    return result;
  };
  EdgeLight edges;
  edges.sides = {side("-u", columns, false), side("+u", columns, true), side("-v", rows, false),
                 side("+v", rows, true)};
  return edges;
}

namespace {

struct EdgeSums {
  double light = 0, variance = 0;
};

// Over the texels whose `unknown` is 0.
LUXFIELD_SIMD_CLONES EdgeSums SumKnown(const float* irradiance, const float* sigma,
                                       const std::uint32_t* unknown, std::size_t texels) {
  constexpr std::size_t kLanes = 8;
  typedef float Floats __attribute__((vector_size(kLanes * sizeof(float))));
  typedef double Doubles __attribute__((vector_size(kLanes * sizeof(double))));
  typedef std::int32_t Words __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
  const Floats none{};
  Doubles light{}, variance{};
  std::size_t p = 0;
  for (; p + kLanes <= texels; p += kLanes) {
    Floats e, s;
    Words gap;
    std::memcpy(&e, irradiance + p, sizeof e);
    std::memcpy(&s, sigma + p, sizeof s);
    std::memcpy(&gap, unknown + p, sizeof gap);
    light += __builtin_convertvector(gap != 0 ? none : e, Doubles);
    const Doubles deviation = __builtin_convertvector(gap != 0 ? none : s, Doubles);
    variance += deviation * deviation;
  }
  EdgeSums sums;
  for (std::size_t k = 0; k < kLanes; ++k) {
    sums.light += light[k];
    sums.variance += variance[k];
  }
  for (; p < texels; ++p) {
    if (unknown[p]) continue;
    sums.light += irradiance[p];
    sums.variance += double{sigma[p]} * sigma[p];
  }
  return sums;
}

}  // namespace

// Row by row, so that rows that come apart give the same sums.
void EdgeLightSums::Add(std::span<const Measurements> rows) {
  geometry_ = rows.front().geometry;
  measurements_ = rows.size();
  const auto count = static_cast<std::size_t>(geometry_.grid.count());
  light_.resize(count);
  variance_.resize(count);
  const std::size_t texels = geometry_.plane_size(),
                    width = static_cast<std::size_t>(geometry_.lattice.width);
  std::vector<std::uint32_t> unknown(width);
  for (std::size_t row = 0; row < texels; row += width) {
    std::fill(unknown.begin(), unknown.end(), 0u);
    for (const Measurements& one : rows)
      for (const auto& position : one.positions)
        for (std::size_t p = 0; p < width; ++p) unknown[p] |= position.mask[row + p] & kUnknownMask;
    for (const Measurements& one : rows)
      for (std::size_t m = 0; m < count; ++m)
        for (int channel = 0; channel < geometry_.channels; ++channel) {
          const std::size_t first = channel * texels + row;
          const EdgeSums sums =
              SumKnown(one.positions[m].irradiance.data() + first,
                       one.positions[m].sigma.data() + first, unknown.data(), width);
          light_[m] += sums.light;
          variance_[m] += sums.variance;
        }
  }
}

EdgeLight EdgeLightSums::Find() const {
  const double sum = std::accumulate(light_.begin(), light_.end(), 0.0);
  EdgeLight edges = FindEdgeLight(geometry_.grid, light_, variance_);
  edges.measured_flux = sum * geometry_.lattice.texel_area_m2() /
                        (geometry_.channels * static_cast<double>(measurements_));
  return edges;
}

EdgeLight FindEdgeLight(std::span<const Measurements> measurements) {
  EdgeLightSums sums;
  sums.Add(measurements);
  return sums.Find();
}

std::vector<std::string> EdgeWarnings(const EdgeLight& edges, const BasisGrid& grid) {
  std::vector<std::string> warnings;
  for (const EdgeSide& side : edges.sides)
    if (side.reached)
      warnings.push_back(fmt::format(
          "Light reaches the outer filters on the side {} ({:.3g} of what the row next to them "
          "sees, at most {:.2g} of a lamp that lies inside): what leaves beyond them is not "
          "measured, the flux is a lower bound; add positions of the filter on that side.",
          side.name, side.ratio, LargestEdgeRatio(grid.basis).value_or(0)));
  return warnings;
}

nlohmann::json ToJson(const EdgeLight& edges) {
  nlohmann::json sides = nlohmann::json::array();
  for (const EdgeSide& side : edges.sides)
    sides.push_back({{"side", side.name},
                     {"ratio", side.ratio},
                     {"share", side.share},
                     {"reached", side.reached}});
  return {{"sides", sides}, {"measured_flux", edges.measured_flux}};
}

}  // namespace luxfield::lightfield
