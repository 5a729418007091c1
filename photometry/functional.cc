#include "luxfield/photometry/functional.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/projected_texels.h"
#include "luxfield/photometry/point_nodes.h"

namespace luxfield::photometry {
namespace {

using lightfield::BasisGrid;
using lightfield::Dot;
using lightfield::LuminaireGeometry;
using lightfield::PencilAxis;
using lightfield::PosedLightField;
using lightfield::ProjectAllTexels;
using lightfield::ProjectedTexels;
using lightfield::TexelAxis;
using lightfield::Vec3;

// The runs of texels that any basis function of an axis meets, together: first and size.
struct Run {
  int first = 0, size = 0;
};
Run RunOf(const std::vector<ProjectedTexels>& all) {
  int first = 0, last = -1;
  for (const ProjectedTexels& one : all) {
    if (one.size() == 0) continue;
    const int end = one.first + static_cast<int>(one.size()) - 1;
    first = last < 0 ? one.first : std::min(first, one.first);
    last = std::max(last, end);
  }
  return {first, last - first + 1};
}

TexelWindow Hull(const TexelWindow& a, const TexelWindow& b) {
  if (a.size() == 0) return b;
  if (b.size() == 0) return a;
  const int row0 = std::min(a.row0, b.row0), column0 = std::min(a.column0, b.column0);
  return {row0, std::max(a.row0 + a.rows, b.row0 + b.rows) - row0, column0,
          std::max(a.column0 + a.columns, b.column0 + b.columns) - column0};
}

FieldFunctional Empty(const LuminaireGeometry& geometry, const TexelWindow& window) {
  FieldFunctional empty;
  if (window.rows <= 0 || window.columns <= 0) return empty;
  empty.window = window;
  empty.weights.assign(geometry.grid.count() * window.size(), 0.0);
  return empty;
}
FieldFunctional EmptyOfAll(const LuminaireGeometry& geometry) {
  return Empty(geometry, {0, geometry.lattice.height, 0, geometry.lattice.width});
}

// One pencil of lines: texels on F along both axes.
struct Pencil {
  std::vector<ProjectedTexels> columns, rows;

  Pencil(const LuminaireGeometry& g, const PencilAxis& x, const PencilAxis& y)
      : columns(ProjectAllTexels(g.grid.basis, g.grid.u0_m, g.grid.spacing_m, g.grid.width,
                                 TexelAxis::Columns(g.lattice), x)),
        rows(ProjectAllTexels(g.grid.basis, g.grid.v0_m, g.grid.spacing_m, g.grid.height,
                              TexelAxis::Rows(g.lattice), y)) {}
};

// Adds weight(columns of i, c, rows of j, r) for every texel that a basis function meets; the window of
// `sum` holds them.
template <typename F>
void AddSeparable(const LuminaireGeometry& g, const Pencil& pencil, F&& weight,
                  FieldFunctional* sum) {
  const TexelWindow& window = sum->window;
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i) {
      const ProjectedTexels &x = pencil.columns[i], &y = pencil.rows[j];
      for (std::size_t r = 0; r < y.size(); ++r) {
        const std::size_t row = g.grid.index(i, j) * window.rows + y.first - window.row0 + r;
        double* to = &sum->weights[row * window.columns + x.first - window.column0];
        for (std::size_t c = 0; c < x.size(); ++c) to[c] += weight(x, c, y, r);
      }
    }
}

Pencil PencilTowards(const LuminaireGeometry& g, Vec3 d) {
  return {g, PencilAxis::Parallel(g.delta_m * d.x / d.z),
          PencilAxis::Parallel(g.delta_m * d.y / d.z)};
}
// delta^2 / cos^3.
double IntensityScale(const LuminaireGeometry& g, Vec3 d) {
  const double cosine =
      lightfield::CosTheta(g.delta_m, {0, 0}, {g.delta_m * d.x / d.z, g.delta_m * d.y / d.z});
  return g.delta_m * g.delta_m / (cosine * cosine * cosine);
}

Pencil PencilThrough(const LuminaireGeometry& g, Vec3 p) {
  return {g, PencilAxis::ThroughPoint(p.x, p.z, g.delta_m),
          PencilAxis::ThroughPoint(p.y, p.z, g.delta_m)};
}

// The texels that a pencil meets.
TexelWindow WindowOf(const Pencil& pencil) {
  const Run rows = RunOf(pencil.rows), columns = RunOf(pencil.columns);
  if (rows.size <= 0 || columns.size <= 0) return {};
  return {rows.first, rows.size, columns.first, columns.size};
}

// factor J.n of one field, in its own frame; exact where n.w >= 0 all over the supports.
void AddLinearIlluminance(const LuminaireGeometry& g, const Pencil& pencil, double factor, Vec3 p,
                          Vec3 n, FieldFunctional* sum) {
  // delta^2 / z^3 n . (u - p), with lengths in units of z as in light_vector.cc.
  const double scale = factor * g.delta_m / p.z * (g.delta_m / p.z);
  AddSeparable(
      g, pencil,
      [&](const ProjectedTexels& x, std::size_t c, const ProjectedTexels& y, std::size_t r) {
        return scale * (n.x * x.moment[c] / p.z * y.zeroth[r] +
                        n.y * x.zeroth[c] * y.moment[r] / p.z - n.z * x.zeroth[c] * y.zeroth[r]);
      },
      sum);
}

FieldFunctional LinearIlluminance(const LuminaireGeometry& g, Vec3 p, Vec3 n) {
  if (!(p.z > 0)) return {};
  const Pencil pencil = PencilThrough(g, p);
  FieldFunctional out = Empty(g, WindowOf(pencil));
  if (!out.weights.empty()) AddLinearIlluminance(g, pencil, 1, p, n, &out);
  return out;
}

void AddIntensity(const LuminaireGeometry& g, const Pencil& pencil, double factor, Vec3 d,
                  FieldFunctional* sum) {
  const double scale = factor * IntensityScale(g, d);
  AddSeparable(
      g, pencil,
      [&](const ProjectedTexels& x, std::size_t c, const ProjectedTexels& y, std::size_t r) {
        return scale * x.zeroth[c] * y.zeroth[r];
      },
      sum);
}

// The zeroth moments of a pencil's texels over a window, of one axis: [function][texel].
std::vector<double> Laid(const std::vector<ProjectedTexels>& axis, int first, int count,
                         double factor) {
  std::vector<double> laid(axis.size() * count, 0.0);
  for (std::size_t k = 0; k < axis.size(); ++k)
    for (std::size_t at = 0; at < axis[k].size(); ++at)
      laid[k * count + axis[k].first - first + at] = factor * axis[k].zeroth[at];
  return laid;
}

// Of each field, of(geometry, field_from_luminaire).
template <typename F>
Functional OfFields(const Lamp& lamp, F&& of) {
  Functional functional;
  for (const PosedLightField& posed : lamp.fields)
    functional.push_back(of(posed.field.geometry, posed.luminaire_from_field));
  return functional;
}

// A kernel of directions in the luminaire's frame.
template <typename Kernel>
Functional OfKernelAt(const Lamp& lamp, Vec3 p, Kernel&& kernel) {
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    return OfKernel(g, pose.Inverse().Point(p), 1,
                    [&](Vec3 w) { return kernel(pose.Direction(w)); });
  });
}

// Of every piece along both axes where a horizon cuts the light, and makes a kink in k.
constexpr int kPartsAtHorizon = 6;

void AddTo(FieldFunctional& sum, int images, double factor, const FieldFunctional& one) {
  const TexelWindow &to = sum.window, &from = one.window;
  for (int m = 0; m < images; ++m)
    for (int r = 0; r < from.rows; ++r) {
      const double* source = &one.weights[(std::size_t(m) * from.rows + r) * from.columns];
      const std::size_t row = std::size_t(m) * to.rows + from.row0 - to.row0 + r;
      double* target = &sum.weights[row * to.columns + from.column0 - to.column0];
      for (int c = 0; c < from.columns; ++c) target[c] += factor * source[c];
    }
}

// Does the cone hold all of the filter plane that a basis function is on?
bool HoldsSupports(const BasisGrid& grid, Vec3 p, Vec3 axis, double least_cosine) {
  const double u1 = grid.u0_m + (grid.width + grid.basis.cells - 1) * grid.spacing_m,
               v1 = grid.v0_m + (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  for (const double u : {grid.u0_m, u1})
    for (const double v : {grid.v0_m, v1})
      if (Dot(axis, lightfield::Normalized(Vec3{u, v, 0} - p)) < least_cosine) return false;
  return least_cosine > 0;  // the cone is convex
}

}  // namespace

double Value(const Lamp& lamp, const Functional& functional) {
  double sum = 0;
  for (std::size_t k = 0; k < functional.size(); ++k) {
    const auto& [window, weights] = functional[k];
    const auto& field = lamp.fields[k].field;
    const int width = field.geometry.lattice.width;
    if (weights.empty()) continue;
    for (int m = 0; m < field.geometry.grid.count(); ++m)
      for (int r = 0; r < window.rows; ++r) {
        const float* c = &field.image(m, 0)[std::size_t(window.row0 + r) * width + window.column0];
        const double* w = &weights[(std::size_t(m) * window.rows + r) * window.columns];
        for (int q = 0; q < window.columns; ++q) sum += w[q] * c[q];
      }
  }
  return sum;
}

std::optional<double> Uncertainty(const Lamp& lamp, const Functional& functional) {
  if (lamp.noise.empty()) return {};
  double variance = 0;
  for (std::size_t k = 0; k < functional.size(); ++k)
    if (!functional[k].weights.empty())
      variance += lamp.noise[k].Variance(functional[k].window, functional[k].weights);
  return std::sqrt(variance);
}

Estimate Evaluate(const Lamp& lamp, const Functional& functional) {
  return {Value(lamp, functional), Uncertainty(lamp, functional)};
}

Functional Sum(std::span<const FunctionalTerm> terms) {
  Functional sum;
  if (terms.empty()) return sum;
  sum.resize(terms[0].functional->size());
  for (std::size_t k = 0; k < sum.size(); ++k) {
    std::size_t images = 0;
    for (const FunctionalTerm& term : terms) {
      const FieldFunctional& one = (*term.functional)[k];
      sum[k].window = Hull(sum[k].window, one.window);
      if (!one.weights.empty()) images = one.weights.size() / one.window.size();
    }
    sum[k].weights.assign(images * sum[k].window.size(), 0.0);
    for (const FunctionalTerm& term : terms)
      if (const FieldFunctional& one = (*term.functional)[k]; !one.weights.empty())
        AddTo(sum[k], static_cast<int>(images), term.factor, one);
  }
  return sum;
}

Functional Sum(std::initializer_list<FunctionalTerm> terms) {
  return Sum(std::span(terms.begin(), terms.size()));
}

Functional ZeroOf(const Lamp& lamp) {
  return OfFields(
      lamp, [](const LuminaireGeometry& g, const lightfield::RigidPose&) { return EmptyOfAll(g); });
}

void Add(Functional& sum, double factor, const Functional& one) {
  for (std::size_t k = 0; k < sum.size(); ++k)
    if (!one[k].weights.empty())
      AddTo(sum[k], static_cast<int>(sum[k].weights.size() / sum[k].window.size()), factor, one[k]);
}

Functional FluxOf(const Lamp& lamp) {
  return OfFields(lamp, [](const LuminaireGeometry& g, const lightfield::RigidPose&) {
    FieldFunctional out = EmptyOfAll(g);
    std::fill(out.weights.begin(), out.weights.end(),
              g.lattice.texel_area_m2() * g.grid.PhiIntegral());
    return out;
  });
}

Functional FluxTowards(const Lamp& lamp, Vec3 axis) {
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    FieldFunctional out = EmptyOfAll(g);
    const Vec3 n = pose.InverseDirection(axis);
    const int cells = g.grid.basis.cells;
    const double h = g.grid.spacing_m, area = g.lattice.texel_area_m2();
    // Over a texel direction . axis changes by so much; 0 where it is the same all over.
    const double reach =
        std::max(std::abs(n.x) * g.lattice.ds_m + std::abs(n.y) * g.lattice.dt_m, 1e-300);
    constexpr double kNode = 0.21132486540518711775;  // (1 - 1 / sqrt(3)) / 2
    for (int j = 0; j < g.grid.height; ++j)
      for (int i = 0; i < g.grid.width; ++i)
        for (int b = 0; b < 2 * cells; ++b)
          for (int a = 0; a < 2 * cells; ++a) {
            const double fx = a % 2 ? 1 - kNode : kNode, fy = b % 2 ? 1 - kNode : kNode;
            const double u = g.grid.u0_m + (i + a / 2 + fx) * h,
                         v = g.grid.v0_m + (j + b / 2 + fy) * h;
            const double weight = area * h * h / 4 * g.grid.basis.CellValue(a / 2, fx) *
                                  g.grid.basis.CellValue(b / 2, fy);
            double* to = &out.weights[g.grid.index(i, j) * out.window.size()];
            for (int row = 0; row < g.lattice.height; ++row)
              for (int column = 0; column < g.lattice.width; ++column) {
                const auto s = g.lattice.centre(row, column);
                const double height = n.x * (s.x - u) + n.y * (s.y - v) + n.z * g.delta_m;
                to[std::size_t(row) * g.lattice.width + column] +=
                    weight * std::clamp(0.5 + height / reach, 0.0, 1.0);
              }
          }
    return out;
  });
}

Functional IntensityTowards(const Lamp& lamp, Vec3 direction) {
  return IntensitySum(lamp, std::array{WeighedDirection{1, direction}});
}

Functional IntensitySum(const Lamp& lamp, std::span<const WeighedDirection> directions) {
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    struct Part {
      double factor;
      Vec3 d;
      Pencil pencil;
    };
    std::vector<Part> parts;
    TexelWindow window;
    for (const auto& [factor, direction] : directions) {
      const Vec3 d = pose.InverseDirection(direction);
      if (!(d.z > 0)) continue;
      parts.push_back({factor, d, PencilTowards(g, d)});
      window = Hull(window, WindowOf(parts.back().pencil));
    }
    FieldFunctional sum = Empty(g, window);
    if (sum.weights.empty()) return sum;
    for (const Part& part : parts) AddIntensity(g, part.pencil, part.factor, part.d, &sum);
    return sum;
  });
}

Estimate IntensityEstimate(const Lamp& lamp, Vec3 direction) {
  Estimate estimate{IntensityValue(lamp, direction), {}};
  if (lamp.noise.empty()) return estimate;
  double variance = 0;
  for (std::size_t k = 0; k < lamp.fields.size(); ++k) {
    const auto& g = lamp.fields[k].field.geometry;
    const Vec3 d = lamp.fields[k].luminaire_from_field.InverseDirection(direction);
    if (!(d.z > 0)) continue;
    const Pencil pencil = PencilTowards(g, d);
    const TexelWindow window = WindowOf(pencil);
    if (window.size() == 0) continue;
    const SeparableWeights weights{
        Laid(pencil.columns, window.column0, window.columns, IntensityScale(g, d)),
        Laid(pencil.rows, window.row0, window.rows, 1)};
    variance += lamp.noise[k].Variance(window, std::array{weights});
  }
  estimate.u = std::sqrt(variance);
  return estimate;
}

Functional IlluminanceAt(const Lamp& lamp, Vec3 p, Vec3 n) {
  return IlluminanceSum(lamp, std::array{WeighedReceiver{1, p, n}});
}

Functional IlluminanceSum(const Lamp& lamp, std::span<const WeighedReceiver> receivers) {
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    struct Part {
      double factor;
      Vec3 p, n;
      std::optional<Pencil> pencil;  // of closed forms
      FieldFunctional cut;           // where the horizon cuts the light
    };
    std::vector<Part> parts;
    TexelWindow window;
    for (const auto& [factor, p, n] : receivers) {
      const Vec3 own_p = pose.Inverse().Point(p), own_n = pose.InverseDirection(n);
      if (!(own_p.z > 0)) continue;
      Part& part = parts.emplace_back(Part{factor, own_p, own_n, {}, {}});
      if (lightfield::HorizonCutsSupport(g, own_p, own_n)) {
        part.cut = OfKernel(g, own_p, kPartsAtHorizon,
                            [&](Vec3 w) { return std::max(0.0, Dot(own_n, w)); });
        window = Hull(window, part.cut.window);
      } else {
        part.pencil = PencilThrough(g, own_p);
        window = Hull(window, WindowOf(*part.pencil));
      }
    }
    FieldFunctional sum = Empty(g, window);
    if (sum.weights.empty()) return sum;
    for (const Part& part : parts)
      if (part.pencil)
        AddLinearIlluminance(g, *part.pencil, part.factor, part.p, part.n, &sum);
      else if (!part.cut.weights.empty())
        AddTo(sum, g.grid.count(), part.factor, part.cut);
    return sum;
  });
}

std::array<Functional, 3> LightVectorAt(const Lamp& lamp, Vec3 p) {
  const auto along = [&](Vec3 axis) {
    return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
      return LinearIlluminance(g, pose.Inverse().Point(p), pose.InverseDirection(axis));
    });
  };
  return {along({1, 0, 0}), along({0, 1, 0}), along({0, 0, 1})};
}

Functional FluenceRateAt(const Lamp& lamp, Vec3 p) {
  return OfKernelAt(lamp, p, [](Vec3) { return 1.0; });
}

Functional LightWithin(const Lamp& lamp, Vec3 p, Vec3 axis, double half_angle) {
  constexpr int kPartsAtEdge = 4;
  const double least = std::cos(half_angle);
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    const Vec3 own = pose.InverseDirection(axis), at = pose.Inverse().Point(p);
    const bool whole = HoldsSupports(g.grid, at, own, least);
    return OfKernel(g, at, whole ? 1 : kPartsAtEdge,
                    [&](Vec3 w) { return whole || Dot(own, w) >= least ? 1.0 : 0.0; });
  });
}

Functional VeilingLuminanceAt(const Lamp& lamp, Vec3 eye, Vec3 line_of_sight, double age_years) {
  constexpr int kParts = 4;
  constexpr double kNearest_deg = 1.5, kFarthest_deg = 60, kAge = 66.4, kFactor = 9.86;
  const double factor = kFactor * (1 + std::pow(age_years / kAge, 4));
  return OfFields(lamp, [&](const LuminaireGeometry& g, const lightfield::RigidPose& pose) {
    const Vec3 own = pose.InverseDirection(line_of_sight);
    return OfKernel(g, pose.Inverse().Point(eye), kParts, [&](Vec3 w) {
      const double cosine = std::clamp(Dot(own, w), -1.0, 1.0),
                   degrees = std::acos(cosine) * 180 / std::numbers::pi;
      if (degrees < kNearest_deg || degrees > kFarthest_deg) return 0.0;
      return factor * cosine / degrees / degrees;
    });
  });
}

double IntensityValue(const Lamp& lamp, Vec3 direction) {
  return FarFieldIntensity(lamp.fields, direction)[0];
}

double IlluminanceValue(const Lamp& lamp, Vec3 p, Vec3 n) {
  double sum = 0;
  for (const PosedLightField& posed : lamp.fields)
    sum += ExactIrradiance(posed.field, posed.luminaire_from_field.Inverse().Point(p),
                           posed.luminaire_from_field.InverseDirection(n))[0];
  return sum;
}

}  // namespace luxfield::photometry
