#include "luxfield/preprocess/patch_light.h"

#include <algorithm>

#include "luxfield/core/colour.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/projected_texels.h"
#include "luxfield/lightfield/quadrature.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LuminaireGeometry;
using lightfield::PencilAxis;
using lightfield::ProjectedTexels;
using lightfield::TexelAxis;
using lightfield::Vec2;

constexpr int kNodes = 64, kTauNodes = 9;

// Weights of the texels that one basis function sees from one node, cut at the patches' borders.
struct CutWeights {
  int first = 0;                                             // texel
  std::array<std::vector<float>, kPatchesPerSide> weight{};  // of each patch; empty: it has no part
};

// The luminance of every image: [image][row][column].
std::vector<float> LuminanceImages(const lightfield::LightField& field) {
  const LuminaireGeometry& g = field.geometry;
  if (g.channels == 1) return field.data;
  const std::size_t plane = g.plane_size();
  std::vector<float> images(plane * g.grid.count());
  for (int m = 0; m < g.grid.count(); ++m) {
    const auto r = field.image(m, 0), green = field.image(m, 1), b = field.image(m, 2);
    for (std::size_t k = 0; k < plane; ++k)
      images[m * plane + k] = static_cast<float>(core::Luminance({r[k], green[k], b[k]}));
  }
  return images;
}

// Along one axis of F.
struct SideOfF {
  TexelAxis texels;
  double corner = 0, centre = 0;  // of the supports, m
  int functions = 0;
};

SideOfF SideAlong(const LuminaireGeometry& g, bool rows) {
  const Vec2 centre = SupportCentre(g);
  if (rows) return {TexelAxis::Rows(g.lattice), g.grid.v0_m, centre.y, g.grid.height};
  return {TexelAxis::Columns(g.lattice), g.grid.u0_m, centre.x, g.grid.width};
}

// Integral of basis function i over [w_lo, w_hi], w counted from the centre of the supports.
double Integral(const LuminaireGeometry& g, const SideOfF& side, int i, double w_lo, double w_hi) {
  const double h = g.grid.spacing_m, start = side.corner - side.centre + i * h;
  double sum = 0;
  for (int cell = 0; cell < g.grid.basis.cells; ++cell) {
    const double knot = start + cell * h;
    const double a = std::max(w_lo, knot), b = std::min(w_hi, knot + h);
    if (a < b)
      sum += lightfield::Gauss2(
          a, b, [&](double w) { return g.grid.basis.CellValue(cell, (w - knot) / h); });
  }
  return sum;
}

CutWeights Cut(const LuminaireGeometry& g, const SideOfF& side, int i, double a, double tau) {
  const PencilAxis pencil{side.centre + a, side.centre, 1 - tau, 0};
  const ProjectedTexels window = lightfield::ProjectTexels(
      g.grid.basis, side.corner, g.grid.spacing_m, i, side.texels, pencil);
  CutWeights cut;
  cut.first = window.first;
  const double half = side.centre - side.corner, width = 2 * half / kPatchesPerSide;
  for (int part = 0; part < kPatchesPerSide; ++part) {
    const double low = -half + part * width, high = low + width;
    for (std::size_t k = 0; k < window.size(); ++k) {
      const double w_lo = std::max(window.w_lo[k], low), w_hi = std::min(window.w_hi[k], high);
      if (!(w_lo < w_hi)) continue;
      cut.weight[part].resize(window.size());
      cut.weight[part][k] = static_cast<float>(Integral(g, side, i, w_lo, w_hi));
    }
  }
  return cut;
}

// [node * functions + function].
std::vector<CutWeights> CutAll(const LuminaireGeometry& g, const VolumeAxis& axis, double tau,
                               bool rows) {
  const SideOfF side = SideAlong(g, rows);
  std::vector<CutWeights> all(static_cast<std::size_t>(axis.nodes) * side.functions);
  core::ParallelFor(axis.nodes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t node = begin; node < end; ++node)
      for (int i = 0; i < side.functions; ++i)
        all[node * side.functions + i] =
            Cut(g, side, i, axis.first + static_cast<double>(node) * axis.spacing, tau);
  });
  return all;
}

// Adds one row of nodes: `rows` are the weights of its functions, `line` its first node.
void AddLine(const LuminaireGeometry& g, const std::vector<float>& images,
             const std::vector<CutWeights>& columns, const CutWeights* rows, int nodes,
             float* line) {
  const std::size_t width = g.lattice.width, plane = g.plane_size();
  std::vector<float> sums(width);
  for (int i = 0; i < g.grid.width; ++i)
    for (int part = 0; part < kPatchesPerSide; ++part) {
      std::ranges::fill(sums, 0.0f);
      for (int j = 0; j < g.grid.height; ++j) {
        const auto& weight = rows[j].weight[part];
        const float* image = images.data() + g.grid.index(i, j) * plane + rows[j].first * width;
        for (std::size_t r = 0; r < weight.size(); ++r)
          for (std::size_t c = 0; c < width; ++c) sums[c] += weight[r] * image[r * width + c];
      }
      for (int x = 0; x < nodes; ++x) {
        const CutWeights& window = columns[static_cast<std::size_t>(x) * g.grid.width + i];
        for (int across = 0; across < kPatchesPerSide; ++across) {
          const auto& weight = window.weight[across];
          float sum = 0;
          for (std::size_t c = 0; c < weight.size(); ++c) sum += weight[c] * sums[window.first + c];
          line[x * kPatches + part * kPatchesPerSide + across] += sum;
        }
      }
    }
}

VolumeAxis AxisOver(double low, double high, int nodes) {
  return {low, (high - low) / (nodes - 1), nodes};
}

}  // namespace

std::array<Patch, kPatches> PatchesOf(const LuminaireGeometry& geometry) {
  const auto& grid = geometry.grid;
  const Vec2 centre = SupportCentre(geometry), corner{grid.u0_m, grid.v0_m};
  const Vec2 size = (2.0 / kPatchesPerSide) * (centre - corner);
  std::array<Patch, kPatches> patches;
  for (int j = 0; j < kPatchesPerSide; ++j)
    for (int i = 0; i < kPatchesPerSide; ++i) {
      Patch& patch = patches[j * kPatchesPerSide + i];
      patch.low = corner + Vec2{i * size.x, j * size.y};
      patch.high = patch.low + size;
      patch.point = patch.low + Vec2{(j + 0.5) / kPatchesPerSide * size.x,
                                     (i + 0.5) / kPatchesPerSide * size.y};
    }
  return patches;
}

bool PatchLight::IsLit(int patch) const {
  for (std::size_t k = patch; k < light.size(); k += kPatches)
    if (light[k] != 0) return true;
  return false;
}

PatchLight TabulatePatchLight(const lightfield::LightField& field) {
  const LuminaireGeometry& g = field.geometry;
  const auto& lattice = g.lattice;
  const Vec2 centre = SupportCentre(g);
  const double half_u = centre.x - g.grid.u0_m, half_v = centre.y - g.grid.v0_m;
  PatchLight table;
  table.a_x = AxisOver(lattice.s0_m - centre.x - half_u,
                       lattice.s0_m + lattice.extent_s_m() - centre.x + half_u, kNodes);
  table.a_y = AxisOver(lattice.t1_m - lattice.extent_t_m() - centre.y - half_v,
                       lattice.t1_m - centre.y + half_v, kNodes);
  table.tau = AxisOver(0, 1, kTauNodes);
  const std::size_t line = std::size_t{kNodes} * kPatches;
  table.light.assign(line * kNodes * kTauNodes, 0.0f);
  const std::vector<float> images = LuminanceImages(field);
  for (int slice = 0; slice < kTauNodes; ++slice) {
    const double tau = table.tau.first + slice * table.tau.spacing;
    const auto columns = CutAll(g, table.a_x, tau, false), rows = CutAll(g, table.a_y, tau, true);
    core::ParallelFor(kNodes, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
        AddLine(g, images, columns, &rows[y * g.grid.height], kNodes,
                table.light.data() + (slice * kNodes + y) * line);
    });
  }
  return table;
}

}  // namespace luxfield::preprocess
