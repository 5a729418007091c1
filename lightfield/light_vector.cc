#include "luxfield/lightfield/light_vector.h"

#include <algorithm>
#include <vector>

#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::lightfield {
namespace {

// Both axes of the pencil of lines through p, in units of z: with e = (u - p) / z every power of z
// cancels,
//   J = delta^2 sum_m integral C_m Phi_m (e_x, e_y, -1) de.
struct View {
  PencilAxis x, y;
  std::vector<ProjectedTexels> columns, rows;  // per i, per j; lengths / z

  View(const LuminaireGeometry& g, Vec3 p) {
    x = PencilAxis::ThroughPoint(p.x, p.z, g.delta_m);
    y = PencilAxis::ThroughPoint(p.y, p.z, g.delta_m);
    columns = ProjectAllTexels(g.grid.basis, g.grid.u0_m, g.grid.spacing_m, g.grid.width,
                               TexelAxis::Columns(g.lattice), x);
    rows = ProjectAllTexels(g.grid.basis, g.grid.v0_m, g.grid.spacing_m, g.grid.height,
                            TexelAxis::Rows(g.lattice), y);
    for (auto* axis : {&columns, &rows})
      for (ProjectedTexels& texels : *axis)
        for (std::size_t k = 0; k < texels.size(); ++k) {
          texels.zeroth[k] /= p.z;
          texels.moment[k] = texels.moment[k] / p.z / p.z;
        }
  }
};

// Sums over one image of C x the zeroth moment in both axes, the first in x, the first in y.
struct ImageMoments {
  double zeroth = 0, x = 0, y = 0;

  void AddRow(std::span<const float> values, std::span<const double> x_zeroth,
              std::span<const double> x_moment, double y_zeroth, double y_moment) {
    const TwoSums sums = WeightedSums(values, x_zeroth, x_moment);
    zeroth += y_zeroth * sums.a;
    x += y_zeroth * sums.b;
    y += y_moment * sums.a;
  }
  Vec3 Vector() const { return {x, y, -zeroth}; }
};

template <typename T>
void SpreadChannels(std::array<T, 3>& values, int channels) {
  if (channels == 1) values[1] = values[2] = values[0];
}

// g(w) = n . (u - p) / z on F, w the coordinates of `View`.
struct Horizon {
  double x = 0, y = 0, constant = 0;

  Horizon(const View& view, Vec3 p, Vec3 n)
      : x(n.x / p.z),
        y(n.y / p.z),
        constant((n.x * view.x.moment_offset_m + n.y * view.y.moment_offset_m) / p.z - n.z) {}
  double operator()(Vec2 w) const { return x * w.x + y * w.y + constant; }
};

struct Rectangle {
  double x0, x1, y0, y1;
};

// Integral over a triangle, exact for total degree 5 (Radon 1948; Stroud, T2:5-1).
template <typename F>
double TriangleIntegral(Vec2 a, Vec2 b, Vec2 c, F&& f) {
  constexpr double kSqrt15 = 3.87298334620741688518;
  const double area = 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y));
  const Vec2 centroid = (1.0 / 3) * (a + b + c);
  double sum = 9.0 / 40 * f(centroid);
  for (const double sign : {-1.0, 1.0}) {
    const double outer = (6 + sign * kSqrt15) / 21, weight = (155 + sign * kSqrt15) / 1200;
    const double inner = 1 - 2 * outer;
    sum += weight * (f(inner * a + outer * (b + c)) + f(inner * b + outer * (c + a)) +
                     f(inner * c + outer * (a + b)));
  }
  return area * sum;
}

// Integral of f over the part of the rectangle above the horizon.
template <typename F>
double ClippedIntegral(const Rectangle& r, const Horizon& horizon, F&& f) {
  const std::array<Vec2, 4> corners{{{r.x0, r.y0}, {r.x1, r.y0}, {r.x1, r.y1}, {r.x0, r.y1}}};
  std::array<Vec2, 6> polygon;
  std::size_t count = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 a = corners[k], b = corners[(k + 1) % 4];
    const double ga = horizon(a), gb = horizon(b);
    if (ga >= 0) polygon[count++] = a;
    if ((ga < 0) != (gb < 0)) polygon[count++] = a + (ga / (ga - gb)) * (b - a);
  }
  double sum = 0;
  for (std::size_t k = 1; k + 1 < count; ++k)
    sum += TriangleIntegral(polygon[0], polygon[k], polygon[k + 1], f);
  return sum;
}

// Integral of Phi_ij g over the part of a texel's image above the horizon, in units of z.
double CutTexelWeight(const BasisGrid& grid, const View& view, const Horizon& horizon, double z,
                      int i, int j, const Rectangle& texel) {
  const double u_start = grid.u0_m + i * grid.spacing_m - view.x.u_pivot_m;
  const double v_start = grid.v0_m + j * grid.spacing_m - view.y.u_pivot_m;
  double sum = 0;
  for (int b = 0; b < grid.basis.cells; ++b)
    for (int a = 0; a < grid.basis.cells; ++a) {
      const double u = u_start + a * grid.spacing_m, v = v_start + b * grid.spacing_m;
      const Rectangle piece{std::max(texel.x0, u), std::min(texel.x1, u + grid.spacing_m),
                            std::max(texel.y0, v), std::min(texel.y1, v + grid.spacing_m)};
      if (!(piece.x0 < piece.x1 && piece.y0 < piece.y1)) continue;
      sum += ClippedIntegral(piece, horizon, [&](Vec2 w) {
        return horizon(w) * grid.basis.CellValue(a, (w.x - u) / grid.spacing_m) *
               grid.basis.CellValue(b, (w.y - v) / grid.spacing_m);
      });
    }
  return sum / z / z;
}

// One row of an image seen by a receiver whose horizon crosses it: columns [begin, end) are wholly
// above, `cut` are crossed, the others below.
struct CutRow {
  struct Texel {
    std::size_t column;
    double weight;
  };
  std::size_t begin = 0, end = 0;
  std::vector<Texel> cut;
};

CutRow CutOneRow(const BasisGrid& grid, const View& view, const Horizon& horizon, double z, int i,
                 int j, std::size_t r) {
  const ProjectedTexels& columns = view.columns[i];
  const double y0 = view.rows[j].w_lo[r], y1 = view.rows[j].w_hi[r];
  CutRow row;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const Rectangle texel{columns.w_lo[c], columns.w_hi[c], y0, y1};
    const auto [lowest, highest] = std::minmax({horizon({texel.x0, y0}), horizon({texel.x1, y0}),
                                                horizon({texel.x0, y1}), horizon({texel.x1, y1})});
    if (highest <= 0) continue;
    if (lowest < 0) {
      row.cut.push_back({c, CutTexelWeight(grid, view, horizon, z, i, j, texel)});
    } else {
      if (row.begin == row.end) row.begin = c;  // g is linear: what is wholly above is one run
      row.end = c + 1;
    }
  }
  return row;
}

std::array<double, 3> CutIrradiance(const LightField& field, Vec3 p, Vec3 n) {
  const LuminaireGeometry& g = field.geometry;
  const View view(g, p);
  const Horizon horizon(view, p, n);
  std::array<double, 3> irradiance{};
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const ProjectedTexels& columns = view.columns[i];
      const ProjectedTexels& rows = view.rows[j];
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const CutRow row = CutOneRow(g.grid, view, horizon, p.z, i, j, r);
        const std::size_t start = (rows.first + r) * g.lattice.width + columns.first;
        const std::size_t run = row.end - row.begin;
        for (int channel = 0; channel < g.channels; ++channel) {
          const auto image = field.image(g.grid.index(i, j), channel);
          ImageMoments moments;
          moments.AddRow(image.subspan(start + row.begin, run),
                         std::span(columns.zeroth).subspan(row.begin, run),
                         std::span(columns.moment).subspan(row.begin, run), rows.zeroth[r],
                         rows.moment[r]);
          irradiance[channel] += Dot(n, moments.Vector());
          for (const auto& texel : row.cut)
            irradiance[channel] += texel.weight * image[start + texel.column];
        }
      }
    }
  for (double& value : irradiance) value *= g.delta_m * g.delta_m;
  SpreadChannels(irradiance, g.channels);
  return irradiance;
}

// Smallest and largest n . (u - p) over the supports on F.
std::pair<double, double> HeightRange(const LuminaireGeometry& g, Vec3 p, Vec3 n) {
  const BasisGrid& grid = g.grid;
  const double u1 = grid.u0_m + (grid.width + grid.basis.cells - 1) * grid.spacing_m;
  const double v1 = grid.v0_m + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  const auto height = [&](double u, double v) { return Dot(n, Vec3{u, v, 0} - p); };
  return std::minmax(
      {height(grid.u0_m, grid.v0_m), height(u1, grid.v0_m), height(grid.u0_m, v1), height(u1, v1)});
}

}  // namespace

LightVector ClosedFormLightVector(const LightField& field, Vec3 p) {
  LightVector vector;
  if (!(p.z > 0)) return vector;
  const LuminaireGeometry& g = field.geometry;
  const View view(g, p);
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const ProjectedTexels& columns = view.columns[i];
      const ProjectedTexels& rows = view.rows[j];
      for (int channel = 0; channel < g.channels; ++channel) {
        const auto image = field.image(g.grid.index(i, j), channel);
        ImageMoments moments;
        for (std::size_t r = 0; r < rows.size(); ++r) {
          const std::size_t start = (rows.first + r) * g.lattice.width + columns.first;
          moments.AddRow(image.subspan(start, columns.size()), columns.zeroth, columns.moment,
                         rows.zeroth[r], rows.moment[r]);
        }
        vector.j[channel] = vector.j[channel] + moments.Vector();
      }
    }
  for (Vec3& j : vector.j) j = (g.delta_m * g.delta_m) * j;
  SpreadChannels(vector.j, g.channels);
  return vector;
}

bool HorizonCutsSupport(const LuminaireGeometry& geometry, Vec3 p, Vec3 n) {
  return HeightRange(geometry, p, n).first < 0;
}

std::array<double, 3> ExactIrradiance(const LightField& field, Vec3 p, Vec3 n) {
  const auto [lowest, highest] = HeightRange(field.geometry, p, n);
  if (!(p.z > 0) || !(highest > 0)) return {};
  if (lowest < 0) return CutIrradiance(field, p, n);
  const LightVector vector = ClosedFormLightVector(field, p);
  return {Dot(n, vector.j[0]), Dot(n, vector.j[1]), Dot(n, vector.j[2])};
}

}  // namespace luxfield::lightfield
