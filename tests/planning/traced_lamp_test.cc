// The lamp as a light source, against closed forms: Lambert's formula for the irradiance of a
// uniform polygon, and light fields whose errors are known.
#include "luxfield/planning/traced_lamp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/quadrature.h"
#include "luxfield/planning/lamp_picture.h"
#include "luxfield/planning/seen_surfaces.h"
#include "tests/core/chi_squared.h"
#include "tests/render/small_scene.h"

namespace luxfield::planning {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Receiver;

constexpr double kDelta = 0.3, kRadiance = 1e5, kSide = 0.066;
constexpr std::uint64_t kSeed = 20261124;

// Irradiance of a receiver that sees a whole polygon of one radiance in front of it, corners
// counter-clockwise seen from the receiver (J. H. Lambert, Photometria, 1760):
//
//   E = L / 2 sum over edges of (angle between the corners) n . (unit normal of their plane)
double LambertsFormula(double radiance, const std::vector<Vec3>& polygon, const Receiver& at) {
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = polygon[k] - at.p, b = polygon[(k + 1) % polygon.size()] - at.p;
    const Vec3 c = Cross(a, b);
    sum += std::atan2(Length(c), Dot(a, b)) * Dot(at.n, Normalized(c));
  }
  return 0.5 * radiance * std::abs(sum);
}

// The rectangle [-half, right] x [-half, half] on F.
std::vector<Vec3> Part(double half, double right) {
  return {{-half, -half, 0}, {right, -half, 0}, {right, half, 0}, {-half, half, 0}};
}
std::vector<Vec3> WholeSquare() { return Part(kSide / 2, kSide / 2); }

LuminaireGeometry Geometry(lightfield::BasisKind kind = lightfield::BasisKind::kBspline2) {
  LuminaireGeometry g;
  g.delta_m = kDelta;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(kind), 4, 4, 0.033);
  g.lattice = {24, 20, -0.3, 0.26, 0.025, 0.025};
  return g;
}

hal::sim::LabDescription LabWith(std::shared_ptr<const hal::sim::Lamp> lamp, int channels = 1) {
  hal::sim::LabDescription lab;
  lab.lamp = std::move(lamp);
  lab.channels = channels;
  return lab;
}

TracedLamp Square(const LuminaireGeometry& geometry) {
  hal::sim::SquareOptions square;
  square.side_m = kSide;
  square.radiance = kRadiance;
  return {LabWith(hal::sim::MakeSquare(square)), geometry};
}

TEST(TracedLamp, IrradianceOfASquareIsLamberts) {
  const TracedLamp lamp = Square(Geometry());
  const FibonacciLattice points(233);
  core::Random random(kSeed, 0);
  constexpr int kReceivers = 40, kShifts = 24;
  double squares = 0;
  for (int r = 0; r < kReceivers; ++r) {
    // From between the planes to 20 m, tilted by up to 60 degrees, the square above the horizon.
    const double z = 0.15 * std::pow(130, random.Uniform());
    const Receiver at{
        {z * (random.Uniform() - 0.5), z * (random.Uniform() - 0.5), z},
        lightfield::Normalized(Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5, -1})};
    bool above = true;
    for (const Vec3 corner : WholeSquare()) above = above && Dot(at.n, corner - at.p) > 0;
    if (!above) continue;
    double sum = 0, square = 0;
    for (int k = 0; k < kShifts; ++k) {
      const double x = random.Uniform();
      const double e =
          lamp.Irradiance(at, points, {x, random.Uniform()}, [](Vec2) { return true; }).open[0];
      sum += e / kShifts;
      square += e * e / kShifts;
    }
    const double truth = LambertsFormula(kRadiance, WholeSquare(), at);
    const double error = std::sqrt((square - sum * sum) / (kShifts - 1));
    EXPECT_LT(error, 2e-3 * truth);                    // of 233 points
    EXPECT_LT(std::abs(sum - truth), 6 * error) << z;  // Student's t of 23 degrees
    squares += (sum - truth) * (sum - truth) / (error * error) / kReceivers;
  }
  // t^2 of 23 degrees has the mean 23 / 21.
  std::printf("seed %llu, mean t^2 %.2f\n", static_cast<unsigned long long>(kSeed), squares);
  EXPECT_LT(squares, 2.5);
}

TEST(TracedLamp, ChannelsOfOneTracedPlaneHaveTheirColours) {
  hal::sim::SquareOptions square;
  square.side_m = kSide;
  square.colour = {1, 0.5, 0.25};
  LuminaireGeometry g = Geometry();
  g.channels = 3;
  const TracedLamp lamp(LabWith(hal::sim::MakeSquare(square), 3), g);
  const auto light = lamp.Irradiance({{0, 0, 1}, {0, 0, -1}}, FibonacciLattice(89), {0.3, 0.7},
                                     [](Vec2 u) { return u.x > 0; });
  EXPECT_DOUBLE_EQ(light.open[1], 0.5 * light.open[0]);
  EXPECT_DOUBLE_EQ(light.open[2], 0.25 * light.open[0]);
  EXPECT_NEAR(light.seen[2] / light.open[2], 0.5, 0.02);  // half of 89 points, and one
  const double s = 0;
  double density[3];
  lamp.FluxDensity({0, 0}, 0, std::span(&s, 1), density);
  EXPECT_DOUBLE_EQ(density[0], 1 / (kDelta * kDelta));
  EXPECT_DOUBLE_EQ(density[1], 0.5 * density[0]);
  EXPECT_DOUBLE_EQ(density[2], 0.25 * density[0]);
}

// Lambert's formula integrated over the lattice: of receivers on I that face F.
TEST(TracedLamp, FluxOfASquareIsThatOfLambertsFormula) {
  const LuminaireGeometry g = Geometry();
  const LightField dark(g);
  const TracedFlux traced = FluxThrough(g.lattice, Square(g), kSeed);
  double flux = 0;
  for (int row = 0; row < g.lattice.height; ++row)
    for (int column = 0; column < g.lattice.width; ++column)
      flux += lightfield::Gauss3(0, 1, [&](double y) {
        return lightfield::Gauss3(0, 1, [&](double x) {
          const Receiver at{
              {g.lattice.s_of_column(column + x), g.lattice.t_of_row(row + y), kDelta}, {0, 0, -1}};
          return g.lattice.texel_area_m2() * LambertsFormula(kRadiance, WholeSquare(), at);
        });
      });
  std::printf("flux %.3f +- %.3f, Lambert's %.3f\n", traced.value, traced.standard_error, flux);
  EXPECT_LT(traced.standard_error, 2e-3 * flux);
  EXPECT_LT(std::abs(traced.value - flux), kRareZ * traced.standard_error);
  // Nothing of it is in a dark field.
  EXPECT_DOUBLE_EQ(CompareWithLamp({&dark}, Square(g), kSeed)[0].rel_l2, 1);
}

// A uniform lamp of 4 x 4 boxes: errors of light fields that are known.
TEST(TracedLamp, FieldsAreComparedRayByRay) {
  const LuminaireGeometry g = Geometry(lightfield::BasisKind::kBox);
  LightField same(g);
  std::fill(same.data.begin(), same.data.end(), 3e6f);
  const TracedLamp lamp(LabWith(hal::sim::MakeLightFieldLamp(same)), g);
  LightField brighter = same;
  for (float& value : brighter.data) value *= 1.1f;
  LuminaireGeometry narrow = g;  // the columns on the left alone
  narrow.grid.width = 2;
  LightField half(narrow);
  std::fill(half.data.begin(), half.data.end(), 3e6f);
  const auto compared = CompareWithLamp({&same, &brighter, &half}, lamp, kSeed);
  EXPECT_LT(compared[0].rel_l2, 1e-6);
  EXPECT_NEAR(compared[1].rel_l2, 0.1, 1e-6);
  // Of a region of which the lamp fills the share f, RMS over mean is 1 / sqrt(f).
  const auto& lit = lamp.lit();
  const double side = 4 * 0.033, f = side * side / ((lit.x1 - lit.x0) * (lit.y1 - lit.y0));
  EXPECT_NEAR(compared[1].rel_rmse * std::sqrt(f), 0.1, 1e-3);
  // Half of the light is missing; the points tell halves apart to some in 20 x 377.
  EXPECT_NEAR(compared[2].rel_l2, std::sqrt(0.5), 2e-3);
  const double flux = 3e6 * side * side * g.lattice.extent_s_m() * g.lattice.extent_t_m();
  const TracedFlux traced = FluxThrough(g.lattice, lamp, kSeed);
  EXPECT_LT(std::abs(traced.value - flux), kRareZ * traced.standard_error);
  EXPECT_LT(traced.standard_error, 1e-3 * flux);
}

TEST(TracedLamp, IrradianceBehindBoxesIsLamberts) {
  LuminaireGeometry g = Geometry(lightfield::BasisKind::kBox);
  g.lattice = {30, 25, -0.3, 0.25, 0.02, 0.02};
  lightfield::Measurements measurements;
  measurements.geometry = g;
  measurements.positions.resize(g.grid.count());
  for (int m = 0; m < g.grid.count(); ++m) {
    const Vec2 c = g.grid.centre(m % 4, m / 4);
    const auto edge = [](double x) { return std::clamp(x, -kSide / 2, kSide / 2); };
    const double x0 = edge(c.x - 0.0165), x1 = edge(c.x + 0.0165), y0 = edge(c.y - 0.0165),
                 y1 = edge(c.y + 0.0165);
    auto& position = measurements.positions[m];
    position.mask.assign(g.plane_size(), 0);
    for (std::size_t k = 0; k < g.plane_size(); ++k) {
      const int row = static_cast<int>(k) / g.lattice.width,
                column = static_cast<int>(k) % g.lattice.width;
      const double mean = lightfield::Gauss3(0, 1, [&](double y) {
        return lightfield::Gauss3(0, 1, [&](double x) {
          const Receiver at{
              {g.lattice.s_of_column(column + x), g.lattice.t_of_row(row + y), kDelta}, {0, 0, -1}};
          return x0 < x1 && y0 < y1
                     ? LambertsFormula(kRadiance,
                                       {{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}}, at)
                     : 0.0;
        });
      });
      position.irradiance.push_back(static_cast<float>(1.02 * mean));
    }
  }
  // 2 % off everywhere. Means over filter and texel of 377 points are good to 0.2 %, whose squares
  // leave no bias and over 2000 texels no scatter that is seen.
  const TracedLamp lamp = Square(g);
  EXPECT_NEAR(IrradianceAgainstLamp(measurements, lamp, 2000, kSeed).rel_l2, 0.02, 3e-4);
  for (auto& position : measurements.positions)
    for (float& value : position.irradiance) value /= 1.02f;
  EXPECT_LT(IrradianceAgainstLamp(measurements, lamp, 2000, kSeed).rel_l2, 1e-3);
  // What is unknown is no error.
  for (float& value : measurements.positions[5].irradiance) value = 0;
  for (auto& mask : measurements.positions[5].mask) mask = lightfield::kOffSensor;
  EXPECT_LT(IrradianceAgainstLamp(measurements, lamp, 2000, kSeed).rel_l2, 1e-3);
}

// <Phi*_i, Phi_m> = h^2 delta_im: behind dual filters a lamp in the span is its coefficients.
TEST(TracedLamp, IrradianceBehindDualFiltersIsTheCoefficients) {
  const LuminaireGeometry g = Geometry(lightfield::BasisKind::kBilinear);
  LightField field(g);
  core::Random random(kSeed, 1);
  lightfield::Measurements measurements;
  measurements.geometry = g;
  measurements.filter = lightfield::FilterKind::kDual;
  for (int m = 0; m < g.grid.count(); ++m) {
    auto& position = measurements.positions.emplace_back();
    position.mask.assign(g.plane_size(), 0);
    for (float& value : field.image(m, 0)) {
      value = static_cast<float>(1 + random.Uniform());
      position.irradiance.push_back(value * 0.033f * 0.033f);
    }
  }
  const TracedLamp lamp(LabWith(hal::sim::MakeLightFieldLamp(field)), g);
  EXPECT_LT(IrradianceAgainstLamp(measurements, lamp, 1000, kSeed).rel_l2, 5e-3);
}

TEST(TracedLamp, DarkLampsAreRefused) {
  const LuminaireGeometry g = Geometry();
  EXPECT_THROW(TracedLamp(LabWith(hal::sim::MakeLightFieldLamp(LightField(g))), g), InputError);
}

// A square lamp before a wall, and a plate in between that hides what lies right of x = 0.05 on its
// plane from the wall: of the square, what is left of it seen from the receiver.
TEST(LampPicture, LightAndShadowsOfASquareAreLamberts) {
  constexpr double kPlate = 0.5, kEdge = 0.05;
  scene::Scene scene;
  scene.geometry.materials.emplace_back();
  scene.geometry.materials[0].albedo = {0.5f, 0.25f, 0.75f};
  // The luminaire shines along +z of the world, turned by 90 degrees about it and moved.
  scene::AppendQuad({-2, -2, 2}, {4, 0, 0}, {0, 4, 0}, 0, scene.geometry);
  scene::AppendQuad({kEdge, -1, kPlate}, {1, 0, 0}, {0, 2, 0}, 0, scene.geometry);
  scene.camera = scene::Camera::LookAt({-0.4, 0.1, 0.9}, {0, 0, 2}, {0, 1, 0}, 45, 36, 24);
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_traced_lamp.lf.exr";
  lightfield::WriteLightField(file, render::SoftLamp());
  scene.luminaires.push_back(
      {"lamp",
       file,
       {},
       scene::Translation({0.01, 0.02, 0.03}) * scene::RotationXyz({0, 0, 90}),
       2});
  const render::LitScene lit(render::Device::Open(), scene);
  LampPictureOptions options;
  options.seed = kSeed;
  const LampPicture picture = TraceLampPicture(lit, scene, Square(Geometry()), options);
  const SeenSurfaces seen = SeeSurfaces(lit, {});

  double open = 0, shadowed = 0, noise = 0, shadow_noise = 0;
  int partly = 0;
  for (std::size_t i = 0; i < seen.pixel_count(); ++i) {
    ASSERT_TRUE(seen.hit(i));
    const auto& position = seen.position[i].s;
    ASSERT_NEAR(position[2], 2, 1e-5);  // all on the wall
    const Vec3 p = Vec3{position[0], position[1], position[2]} - Vec3{0.01, 0.02, 0.03};
    // In the frame of the square; its sides are the world's.
    const Receiver at{p, {0, 0, -1}};
    const double z = kPlate - 0.03, half = kSide / 2;
    const double at_edge = p.x + (kEdge - 0.01 - p.x) * p.z / (p.z - z);
    const double right = std::clamp(at_edge, -half, half);
    const double whole = 2 * LambertsFormula(kRadiance, WholeSquare(), at);
    const double part = right > -half ? 2 * LambertsFormula(kRadiance, Part(half, right), at) : 0;
    partly += right > -half && right < half;
    const float blue = 0.75f / static_cast<float>(M_PI);
    const auto squared = [](double x) { return x * x; };
    open += squared(picture.irradiance.mean.plane(1)[i] - whole);
    noise += squared(0.5 * (picture.irradiance.a.plane(1)[i] - picture.irradiance.b.plane(1)[i]));
    shadowed += squared(picture.shadowed.mean.plane(2)[i] - blue * part);
    shadow_noise +=
        squared(0.5 * (picture.shadowed.a.plane(2)[i] - picture.shadowed.b.plane(2)[i]));
    EXPECT_NEAR(picture.radiance.mean.plane(2)[i], blue * picture.irradiance.mean.plane(2)[i],
                1e-6 * whole);
    EXPECT_NEAR(picture.irradiance.mean.plane(1)[i], whole, 0.02 * whole);
    EXPECT_NEAR(picture.shadowed.mean.plane(2)[i], blue * part, 0.03 * blue * whole);
  }
  // Half the halves' difference is the standard error of their mean: over 864 pixels its squares
  // agree with the deviations' to a few per cent, were they normal; points of lattices are not.
  std::printf("deviation over noise: %.2f, with shadows %.2f; %d pixels in half-shadow\n",
              std::sqrt(open / noise), std::sqrt(shadowed / shadow_noise), partly);
  EXPECT_GT(partly, 20);
  EXPECT_NEAR(std::sqrt(open / noise), 1, 0.3);
  EXPECT_NEAR(std::sqrt(shadowed / shadow_noise), 1, 0.3);
}

TEST(LampPicture, GlossySurfacesAreRefused) {
  scene::Scene scene = render::LampOverFloor(false);
  scene.geometry.materials[0].kind = scene::MaterialKind::kPhong;
  const render::LitScene lit(render::Device::Open(), scene);
  EXPECT_THROW(TraceLampPicture(lit, scene, Square(Geometry()), {}), InputError);
}

}  // namespace
}  // namespace luxfield::planning
