#include "luxfield/planning/reference_lamps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::planning {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::Dot;
using lightfield::Vec2;
using lightfield::Vec3;

ReferenceLamp Lamp(ReferenceLampKind kind, double radius, Vec2 centre = {}) {
  ReferenceLamp lamp;
  lamp.kind = kind;
  lamp.radius_m = radius;
  lamp.centre_m = centre;
  return lamp;
}

lightfield::LuminaireGeometry Geometry(BasisKind kind, int width, int height) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.6;
  geometry.grid = BasisGrid::Centred(Basis::Make(kind), width, height, 0.033);
  geometry.lattice = {5, 4, -0.5, 0.4, 0.2, 0.2};
  return geometry;
}

// Of a disc of radiance L about the axis at distance d beside the receiver and height z over it,
// facing it: pi L / 2 (1 - (d^2 + z^2 - r^2) / sqrt((d^2 + z^2 + r^2)^2 - 4 d^2 r^2)) (Foote 1915).
double DiscIrradiance(double radiance, double r, double d, double z) {
  const double sum = d * d + z * z, root = std::sqrt(std::pow(sum + r * r, 2) - 4 * d * d * r * r);
  return std::numbers::pi * radiance / 2 * (1 - (sum - r * r) / root);
}

// Lambert's polygon formula: L / 2 sum gamma_k n.(v_k x v_k+1) / |v_k x v_k+1|.
double RectangleIrradiance(double radiance, Vec2 centre, Vec2 half, const Vec3& p, const Vec3& n) {
  Vec3 corners[4];
  const double sign[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
  for (int k = 0; k < 4; ++k)
    corners[k] = Vec3{centre.x + sign[k][0] * half.x, centre.y + sign[k][1] * half.y, 0} - p;
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const Vec3 a = Normalized(corners[k]), b = Normalized(corners[(k + 1) % 4]), c = Cross(a, b);
    sum += std::atan2(Length(c), Dot(a, b)) * Dot(n, c) / Length(c);
  }
  return std::abs(radiance / 2 * sum);
}

TEST(ReferenceLamps, LightAsTheClosedFormsSay) {
  const Vec2 centre{0.02, -0.01};
  const double r = 0.09, radiance = 1e5;
  const auto disc = Lamp(ReferenceLampKind::kDisc, r, centre),
             ring = Lamp(ReferenceLampKind::kRing, r, centre),
             square = Lamp(ReferenceLampKind::kSquare, r, centre),
             filament = Lamp(ReferenceLampKind::kFilament, r, centre);
  for (const double z : {0.2, 0.6, 3.0})
    for (const Vec2 at : {Vec2{0.02, -0.01}, Vec2{0.3, -0.2}, Vec2{-0.05, 0.06}}) {
      const double d = std::hypot(at.x - centre.x, at.y - centre.y);
      const double whole = DiscIrradiance(radiance, r, d, z);
      EXPECT_NEAR(FluxDensityOnI(disc, z, at), whole, 5e-6 * whole);
      const double hollow = whole - DiscIrradiance(radiance, 0.8 * r, d, z);
      EXPECT_NEAR(FluxDensityOnI(ring, z, at), hollow, 1e-5 * hollow);
      const preprocess::Receiver tilted{{at.x, at.y, z},
                                        Normalized(Vec3{-0.2 * at.x / z, 0.3, -1})};
      const double polygon = RectangleIrradiance(radiance, centre, {r, r}, tilted.p, tilted.n);
      EXPECT_NEAR(Irradiance(square, tilted), polygon, 1e-8 * polygon);
      const double thin = RectangleIrradiance(radiance, centre, {r / 20, r}, tilted.p, tilted.n);
      EXPECT_NEAR(Irradiance(filament, tilted), thin, 1e-8 * thin);
    }
}

// The rule of the nodes against the midpoint rule of the radiance itself, whose error at edges is
// about 1 / n of the light of a cell's border: 2e-3 of a headlight cut in two.
TEST(ReferenceLamps, LightAsTheirRadianceSays) {
  const Vec2 centre{0.01, 0.02};
  for (const ReferenceLamp& lamp : ReferenceLamps(0.09, centre))
    for (const Vec3 p : {Vec3{0.05, -0.04, 0.8}, Vec3{-0.1, -0.02, 0.5}}) {
      const Vec3 n = Normalized(Vec3{0.3, 0.2, -1});
      constexpr int kCells = 1600;
      const Vec2 half = lamp.half_size_m();
      const double dx = 2 * half.x / kCells, dy = 2 * half.y / kCells;
      double sum = 0;
      for (int y = 0; y < kCells; ++y)
        for (int x = 0; x < kCells; ++x) {
          const Vec2 u{centre.x - half.x + (x + 0.5) * dx, centre.y - half.y + (y + 0.5) * dy};
          const Vec3 way = Vec3{u.x, u.y, 0} - p;
          const double r2 = Dot(way, way);
          sum += lamp.Radiance(u, {(p.x - u.x) / p.z, (p.y - u.y) / p.z}) *
                 std::max(0.0, Dot(n, way)) * p.z / (r2 * r2);
        }
      const double midpoint = sum * dx * dy;
      ASSERT_GT(midpoint, 0) << lamp.name();
      EXPECT_NEAR(Irradiance(lamp, {p, n}), midpoint, 1e-3 * midpoint) << lamp.name();
    }
}

// What filters that are a partition of unity measure adds up to the flux density; centres of mass
// follow too, sum c_ij E_ij = integral u E du, of filters that hold straight lines.
TEST(ReferenceLamps, FiltersMeasureTheirFluxDensity) {
  struct Case {
    BasisKind kind;
    int width, height;
    bool lines;
  };
  for (const Case& c : {Case{BasisKind::kBox, 7, 6, false}, Case{BasisKind::kBilinear, 8, 7, true},
                        Case{BasisKind::kBspline2, 9, 8, true}}) {
    const auto geometry = Geometry(c.kind, c.width, c.height);
    for (const ReferenceLamp& lamp : ReferenceLamps(0.07, {0.01, -0.005})) {
      const auto measured = MeasureExactly(lamp, geometry);
      for (std::size_t texel = 0; texel < geometry.plane_size(); ++texel) {
        const auto& lattice = geometry.lattice;
        const Vec2 s = lattice.centre(static_cast<int>(texel) / lattice.width,
                                      static_cast<int>(texel) % lattice.width);
        double sum = 0;
        for (const auto& position : measured.positions) sum += position.irradiance[texel];
        const double flux = FluxDensityOnI(lamp, geometry.delta_m, s);
        EXPECT_NEAR(sum, flux, 1e-4 * flux + 1e-6) << lamp.name() << " texel " << texel;
        if (!c.lines || lamp.kind != ReferenceLampKind::kSquare) continue;
        double moment = 0, centre = 0;
        for (int m = 0; m < geometry.grid.count(); ++m)
          moment += geometry.grid.centre(m % c.width, m / c.width).x *
                    measured.positions[m].irradiance[texel];
        constexpr int kCells = 400;  // midpoint rule over the square
        for (int y = 0; y < kCells; ++y)
          for (int x = 0; x < kCells; ++x) {
            const Vec2 u{0.01 + 0.07 * (2.0 * (x + 0.5) / kCells - 1),
                         -0.005 + 0.07 * (2.0 * (y + 0.5) / kCells - 1)};
            centre += u.x * lamp.FluxDensity(geometry.delta_m, u, s);
          }
        centre *= 0.14 * 0.14 / (kCells * kCells);
        EXPECT_NEAR(moment, centre, 1e-5 * 0.07 * flux) << texel;
      }
    }
  }
}

// A filter moved by whole spacings is its neighbour; by a part of one, the integral of its own
// function there.
TEST(ReferenceLamps, DisplacedFiltersMeasureWhereTheyStand) {
  const auto geometry = Geometry(BasisKind::kQuadratic, 5, 4);
  const auto lamp = Lamp(ReferenceLampKind::kDisc, 0.05);
  const auto straight = MeasureExactly(lamp, geometry);
  std::vector<Vec2> displacements(geometry.grid.count());
  displacements[6] = {geometry.grid.spacing_m, 0};
  displacements[7] = {0.3 * geometry.grid.spacing_m, -0.2 * geometry.grid.spacing_m};
  const auto moved = MeasureExactly(lamp, geometry, displacements);
  const Vec2 s = geometry.lattice.centre(1, 2);
  const std::size_t texel = 1 * 5 + 2;
  const float neighbour = straight.positions[7].irradiance[texel];
  EXPECT_NEAR(moved.positions[6].irradiance[texel], neighbour, 1e-6 * neighbour);
  EXPECT_EQ(moved.positions[5].irradiance[texel], straight.positions[5].irradiance[texel]);
  double sum = 0;
  constexpr int kCells = 1000;
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const Vec2 u{0.05 * (2.0 * (x + 0.5) / kCells - 1), 0.05 * (2.0 * (y + 0.5) / kCells - 1)};
      sum +=
          lamp.FluxDensity(geometry.delta_m, u, s) * geometry.grid.Phi(2, 1, u - displacements[7]);
    }
  sum *= 0.1 * 0.1 / (kCells * kCells);
  EXPECT_NEAR(moved.positions[7].irradiance[texel], sum, 2e-4 * sum);
}

// The projection's inner products with the basis are what was measured: by Gauss rules of the light
// field's own flux density, cell by cell.
TEST(ReferenceLamps, ProjectionMeasuresTheSame) {
  const auto geometry = Geometry(BasisKind::kBspline2, 4, 5);
  const auto lamp = Lamp(ReferenceLampKind::kFaceted, 0.05);
  const auto measured = MeasureExactly(lamp, geometry);
  const auto field = Project(lamp, geometry);
  const std::size_t texel = 2 * 5 + 2;
  const Vec2 s = geometry.lattice.centre(2, 2);
  const auto& grid = geometry.grid;
  double largest = 0;
  for (const auto& position : measured.positions)
    largest = std::max<double>(largest, position.irradiance[texel]);
  for (int m = 0; m < grid.count(); ++m) {
    const int i = m % grid.width, j = m / grid.width;
    constexpr int kPoints = 60;  // per cell: midpoint, second order
    const double step = grid.spacing_m / kPoints;
    double sum = 0;
    for (int y = 0; y < 3 * kPoints; ++y)
      for (int x = 0; x < 3 * kPoints; ++x) {
        const Vec2 u{grid.u0_m + i * grid.spacing_m + (x + 0.5) * step,
                     grid.v0_m + j * grid.spacing_m + (y + 0.5) * step};
        sum += FluxDensity(field, u, s)[0] * grid.Phi(i, j, u);
      }
    EXPECT_NEAR(sum * step * step, measured.positions[m].irradiance[texel], 2e-4 * largest) << m;
  }
}

TEST(ReferenceLamps, ReceiversSeeTheLampThroughTheLattice) {
  auto geometry = Geometry(BasisKind::kBspline2, 9, 7);
  const auto receivers = ReferenceReceivers(geometry, 200, 5);
  ASSERT_EQ(receivers.size(), 200u);
  const auto& grid = geometry.grid;
  for (const auto& [p, n] : receivers) {
    EXPECT_FALSE(HorizonCutsSupport(geometry, p, n));
    for (const double u : {grid.u0_m, -grid.u0_m})
      for (const double v : {grid.v0_m, -grid.v0_m}) {
        const double tau = geometry.delta_m / p.z;
        EXPECT_LE(std::abs(tau * p.x + (1 - tau) * u), 0.5 + 1e-9);
        EXPECT_LE(std::abs(tau * p.y + (1 - tau) * v), 0.4 + 1e-9);
      }
  }
  geometry.lattice = {4, 4, -0.05, 0.05, 0.025, 0.025};
  EXPECT_THROW(ReferenceReceivers(geometry, 5, 1), InputError);
}

}  // namespace
}  // namespace luxfield::planning
