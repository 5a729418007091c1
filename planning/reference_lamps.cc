#include "luxfield/planning/reference_lamps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::planning {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::Dot;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Receiver;

constexpr double kRingInside = 0.8;      // of the radius
constexpr double kFilamentWidth = 0.05;  // half of it, of the radius
constexpr int kFacets = 5;               // along the footprint's bounding square
constexpr double kCutoffHeight = -0.01, kCutoffSlope = 0.27;

bool IsRound(ReferenceLampKind kind) {
  return kind != ReferenceLampKind::kSquare && kind != ReferenceLampKind::kFilament;
}

// The highest w_y that the headlight sends light to.
double Cutoff(double w_x) { return kCutoffHeight + kCutoffSlope * std::max(0.0, w_x); }

// Beam of the facet under u, counted from the footprint's centre in units of its radius.
double FacetBeam(Vec2 u, Vec2 w) {
  const double k = 7 * std::floor((u.x + 1) / 2 * kFacets) + std::floor((u.y + 1) / 2 * kFacets);
  const double dx = w.x - 0.15 * std::sin(2.7 * k + 1), dy = w.y - 0.1 * std::sin(4.1 * k + 2);
  return std::exp(-(dx * dx + dy * dy) / (0.06 * 0.06));
}

// Where a nested rule has to be cut along one axis.
class Cuts {
 public:
  Cuts(double lo, double hi) : lo_(lo), hi_(hi), at_{lo, hi} {}

  void Add(double x) {
    if (x > lo_ && x < hi_) at_.push_back(x);
  }
  void Add(std::span<const double> xs) {
    for (const double x : xs) Add(x);
  }

  // fn(x, weight) of a five-point Gauss-Legendre rule (Abramowitz & Stegun 25.4.30) in every
  // piece, longer ones than `longest` divided. `rooted`: x runs over a piece as (3 t - t^3) / 2,
  // which makes square roots at its ends smooth.
  template <typename Fn>
  void Integrate(double longest, bool rooted, Fn&& fn) {
    constexpr std::array<double, 5> kNode{-0.90617984593866399280, -0.53846931010568309104, 0,
                                          0.53846931010568309104, 0.90617984593866399280};
    constexpr std::array<double, 5> kWeight{0.23692688505618908751, 0.47862867049936646804,
                                            0.56888888888888888889, 0.47862867049936646804,
                                            0.23692688505618908751};
    std::sort(at_.begin(), at_.end());
    for (std::size_t piece = 0; piece + 1 < at_.size(); ++piece) {
      const double length = at_[piece + 1] - at_[piece];
      if (!(length > 1e-12 * (hi_ - lo_))) continue;
      const int parts = static_cast<int>(std::ceil(length / longest - 1e-9));
      const double half = length / parts / 2;
      for (int part = 0; part < parts; ++part) {
        const double middle = at_[piece] + (2 * part + 1) * half;
        for (std::size_t k = 0; k < kNode.size(); ++k) {
          const double t = kNode[k];
          if (rooted)
            fn(middle + half * t * (3 - t * t) / 2, half * kWeight[k] * 1.5 * (1 - t * t));
          else
            fn(middle + half * t, half * kWeight[k]);
        }
      }
    }
  }

 private:
  double lo_, hi_;
  std::vector<double> at_;
};

// fn(u, weight L(u->p)) of nodes that integrate over the footprint functions that are smooth
// between the knots (absolute, m). p.z > 0.
template <typename Fn>
void ForEachNode(const ReferenceLamp& lamp, Vec3 p, std::span<const double> knots_u,
                 std::span<const double> knots_v, Fn&& fn) {
  using Kind = ReferenceLampKind;
  const double r = lamp.radius_m, inside = kRingInside * r;
  const Vec2 c = lamp.centre_m, half = lamp.half_size_m();
  const bool round = IsRound(lamp.kind), ring = lamp.kind == Kind::kRing;
  const double longest = r / 3;
  const auto chord = [](double radius, double x) { return std::sqrt(radius * radius - x * x); };
  std::vector<double> facets;
  if (lamp.kind == Kind::kFaceted)
    for (int k = 1; k < kFacets; ++k) facets.push_back(r * (2.0 * k / kFacets - 1));

  Cuts columns(c.x - half.x, c.x + half.x);
  columns.Add(knots_u);
  const auto add_crossings = [&](double y) {  // of the border with a horizontal line
    for (const double radius : {r, inside})
      if (std::abs(y) < radius && (radius == r || ring))
        for (const double sign : {-1, 1}) columns.Add(c.x + sign * chord(radius, y));
  };
  if (round)
    for (const double v : knots_v) add_crossings(v - c.y);
  for (const double f : facets) columns.Add(c.x + f), add_crossings(f);
  if (ring) columns.Add(c.x - inside), columns.Add(c.x + inside);
  if (lamp.kind == Kind::kHeadlight) {
    columns.Add(p.x);
    // The cut-off is y = v0 to the right of p.x and y = v0 + slope (x - p.x) to its left.
    const double v0 = p.y - p.z * kCutoffHeight;
    for (const double v : knots_v) columns.Add(p.x + (v - v0) / kCutoffSlope);
    for (const double slope : {0.0, kCutoffSlope}) {
      const double at_centre = v0 + slope * (c.x - p.x) - c.y, k = 1 + slope * slope;
      const double root2 =
          slope * slope * at_centre * at_centre - k * (at_centre * at_centre - r * r);
      for (const double sign : {-1, 1})
        if (root2 > 0) columns.Add(c.x + (-slope * at_centre + sign * std::sqrt(root2)) / k);
    }
  }

  columns.Integrate(longest, round, [&](double x, double weight_x) {
    const double off = x - c.x, outer = round ? chord(r, off) : half.y;
    const double inner = ring && std::abs(off) < inside ? chord(inside, off) : 0;
    double lowest = -std::numeric_limits<double>::infinity();
    if (lamp.kind == Kind::kHeadlight) lowest = p.y - p.z * Cutoff((p.x - x) / p.z);
    for (const auto& [from, to] : {std::pair{-outer, -inner}, std::pair{inner, outer}}) {
      const double lo = std::max(c.y + from, lowest), hi = c.y + to;
      if (!(lo < hi)) continue;
      Cuts rows(lo, hi);
      rows.Add(knots_v);
      for (const double f : facets) rows.Add(c.y + f);
      rows.Integrate(longest, false, [&](double y, double weight_y) {
        const Vec2 u{x, y};
        fn(u, weight_x * weight_y * lamp.Radiance(u, {(p.x - x) / p.z, (p.y - y) / p.z}));
      });
    }
  });
}

double Cos4OverDelta2(double delta, Vec2 u, Vec2 s) {
  const double dx = s.x - u.x, dy = s.y - u.y, r2 = delta * delta + dx * dx + dy * dy;
  return delta * delta / (r2 * r2);
}

std::vector<double> Knots(const Basis& basis, int count, double first, double spacing) {
  std::vector<double> knots;
  for (int k = 0; k < count + basis.cells; ++k) knots.push_back(first + k * spacing);
  return knots;
}

// E_ij(s) of every filter of `grid`, added to e[m].
void AddFilters(const ReferenceLamp& lamp, double delta, const BasisGrid& grid, Vec2 s,
                std::span<double> e) {
  const Basis& basis = grid.basis;
  const auto knots_u = Knots(basis, grid.width, grid.u0_m, grid.spacing_m),
             knots_v = Knots(basis, grid.height, grid.v0_m, grid.spacing_m);
  struct Values {
    int first = 0;  // function of values[0]
    std::array<double, Basis::kMaxCells> values{};
  };
  const auto along = [&](double x) {
    const int cell = static_cast<int>(std::floor(x));
    Values result{cell - basis.cells + 1, {}};
    for (int k = 0; k < basis.cells; ++k)
      result.values[k] = basis.CellValue(basis.cells - 1 - k, x - cell);
    return result;
  };
  ForEachNode(lamp, {s.x, s.y, delta}, knots_u, knots_v, [&](Vec2 u, double weight) {
    const double flux = weight * Cos4OverDelta2(delta, u, s);
    const Values a = along((u.x - grid.u0_m) / grid.spacing_m),
                 b = along((u.y - grid.v0_m) / grid.spacing_m);
    for (int y = 0; y < basis.cells; ++y)
      for (int x = 0; x < basis.cells; ++x) {
        const int i = a.first + x, j = b.first + y;
        if (i >= 0 && i < grid.width && j >= 0 && j < grid.height)
          e[grid.index(i, j)] += flux * a.values[x] * b.values[y];
      }
  });
}

// E[m][texel] of the middles of all texels.
std::vector<std::vector<double>> Filtered(const ReferenceLamp& lamp,
                                          const LuminaireGeometry& geometry,
                                          std::span<const Vec2> displacements_m) {
  const BasisGrid& grid = geometry.grid;
  const auto& lattice = geometry.lattice;
  std::vector<std::vector<double>> e(grid.count(), std::vector<double>(geometry.plane_size()));
  core::ParallelFor(geometry.plane_size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> one(grid.count());
    for (std::size_t texel = begin; texel < end; ++texel) {
      const auto row = static_cast<int>(texel / lattice.width),
                 column = static_cast<int>(texel % lattice.width);
      const Vec2 s = lattice.centre(row, column);
      std::fill(one.begin(), one.end(), 0.0);
      if (displacements_m.empty()) {
        AddFilters(lamp, geometry.delta_m, grid, s, one);
      } else {
        for (int m = 0; m < grid.count(); ++m) {
          BasisGrid filter{grid.basis, 1, 1, 0, 0, grid.spacing_m};
          filter.u0_m = grid.u0_m + m % grid.width * grid.spacing_m + displacements_m[m].x;
          filter.v0_m = grid.v0_m + m / grid.width * grid.spacing_m + displacements_m[m].y;
          AddFilters(lamp, geometry.delta_m, filter, s, std::span(one).subspan(m, 1));
        }
      }
      for (int m = 0; m < grid.count(); ++m) e[m][texel] = one[m];
    }
  });
  return e;
}

}  // namespace

std::string ReferenceLamp::name() const {
  constexpr std::array kNames{"square",   "disc",      "filament", "ring",
                              "gaussian", "headlight", "faceted"};
  return kNames[static_cast<std::size_t>(kind)];
}

Vec2 ReferenceLamp::half_size_m() const {
  return {kind == ReferenceLampKind::kFilament ? kFilamentWidth * radius_m : radius_m, radius_m};
}

double ReferenceLamp::Radiance(Vec2 u, Vec2 w) const {
  const Vec2 x = (1 / radius_m) * (u - centre_m);
  const double r2 = x.x * x.x + x.y * x.y, w2 = w.x * w.x + w.y * w.y;
  if (IsRound(kind) ? r2 > 1 : std::abs(x.x) > half_size_m().x / radius_m || std::abs(x.y) > 1)
    return 0;
  switch (kind) {
    case ReferenceLampKind::kSquare:
    case ReferenceLampKind::kDisc:
    case ReferenceLampKind::kFilament:
      return radiance;
    case ReferenceLampKind::kRing:
      return r2 < kRingInside * kRingInside ? 0 : radiance;
    case ReferenceLampKind::kGaussian:
      return radiance * std::exp(-8 * r2 - 16 * w2);
    case ReferenceLampKind::kHeadlight:
      return w.y > Cutoff(w.x) ? 0 : radiance * std::exp(-25 * w.x * w.x - 123 * w.y * w.y);
    case ReferenceLampKind::kFaceted:
      return radiance * FacetBeam(x, w);
  }
  throw InputError("a reference lamp of no kind");
}

double ReferenceLamp::FluxDensity(double delta_m, Vec2 u, Vec2 s) const {
  return Radiance(u, (1 / delta_m) * (s - u)) * Cos4OverDelta2(delta_m, u, s);
}

std::vector<ReferenceLamp> ReferenceLamps(double radius_m, Vec2 centre_m) {
  using enum ReferenceLampKind;
  std::vector<ReferenceLamp> lamps;
  for (const auto kind : {kSquare, kDisc, kFilament, kRing, kGaussian, kHeadlight, kFaceted})
    lamps.push_back({kind, radius_m, centre_m});
  return lamps;
}

double Irradiance(const ReferenceLamp& lamp, const Receiver& receiver) {
  const auto& [p, n] = receiver;
  double sum = 0;
  ForEachNode(lamp, p, {}, {}, [&](Vec2 u, double weight) {
    const Vec3 way = Vec3{u.x, u.y, 0} - p;
    const double r2 = Dot(way, way);
    sum += weight * std::max(0.0, Dot(n, way)) * p.z / (r2 * r2);
  });
  return sum;
}

double FluxDensityOnI(const ReferenceLamp& lamp, double delta_m, Vec2 s) {
  return Irradiance(lamp, {{s.x, s.y, delta_m}, {0, 0, -1}});
}

lightfield::Measurements MeasureExactly(const ReferenceLamp& lamp,
                                        const LuminaireGeometry& geometry,
                                        std::span<const Vec2> displacements_m) {
  const auto e = Filtered(lamp, geometry, displacements_m);
  lightfield::Measurements result;
  result.geometry = geometry;
  const std::size_t texels = geometry.plane_size();
  for (std::size_t m = 0; m < e.size(); ++m) {
    lightfield::Measurement& position = result.positions.emplace_back();
    for (int channel = 0; channel < geometry.channels; ++channel)
      for (const double value : e[m]) position.irradiance.push_back(static_cast<float>(value));
    position.sigma.assign(texels * geometry.channels, 0.0f);
    position.count.assign(texels, 1.0f);
    position.mask.assign(texels, 0);
    if (!displacements_m.empty()) position.displacement_m = displacements_m[m];
  }
  return result;
}

lightfield::LightField Project(const ReferenceLamp& lamp, const LuminaireGeometry& geometry) {
  auto e = Filtered(lamp, geometry, {});
  std::vector<const double*> in;
  std::vector<double*> out;
  for (auto& image : e) in.push_back(image.data()), out.push_back(image.data());
  reconstruct::GramSolver(geometry.grid)
      .Solve<double, double>(in.data(), out.data(), geometry.plane_size());
  lightfield::LightField field(geometry);
  for (std::size_t m = 0; m < e.size(); ++m)
    for (int channel = 0; channel < geometry.channels; ++channel)
      std::copy(e[m].begin(), e[m].end(), field.image(static_cast<int>(m), channel).begin());
  return field;
}

std::vector<Receiver> ReferenceReceivers(const LuminaireGeometry& geometry, int count,
                                         std::uint64_t seed) {
  const BasisGrid& grid = geometry.grid;
  const auto& lattice = geometry.lattice;
  const Vec2 centre = preprocess::SupportCentre(geometry);
  const auto half = [&](int functions) {
    return 0.5 * (functions + grid.basis.cells - 1) * grid.spacing_m;
  };
  const Vec2 half_f{half(grid.width), half(grid.height)};
  core::Random random(seed, 0x72656365);
  // a = tau p such that a + (1 - tau) u lies between lo and hi for |u - centre| < half
  const auto within = [&](double tau, double middle, double reach, double lo, double hi) {
    const double first = lo - (1 - tau) * (middle - reach),
                 last = hi - (1 - tau) * (middle + reach);
    if (!(first < last))
      throw InputError("the lattice on I is not larger than the supports on F; widen it");
    return (first + (last - first) * random.Uniform()) / tau;
  };
  std::vector<Receiver> receivers;
  while (static_cast<int>(receivers.size()) < count) {
    Receiver receiver;
    Vec3& p = receiver.p;
    p.z = geometry.delta_m * (1 + 0.3 * std::pow(100.0, random.Uniform()));
    const double tau = geometry.delta_m / p.z;
    p.x = within(tau, centre.x, half_f.x, lattice.s0_m, lattice.s_of_column(lattice.width));
    p.y = within(tau, centre.y, half_f.y, lattice.t_of_row(lattice.height), lattice.t1_m);
    const Vec3 way{(centre.x - p.x) / p.z, (centre.y - p.y) / p.z, -1};
    const auto turned = [&] { return 0.7 * (2 * random.Uniform() - 1); };
    const double turn_x = turned(), turn_y = turned();
    receiver.n = Normalized(way + Vec3{turn_x, turn_y, 0});
    if (!HorizonCutsSupport(geometry, receiver.p, receiver.n)) receivers.push_back(receiver);
  }
  return receivers;
}

}  // namespace luxfield::planning
