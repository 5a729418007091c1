// kernels/brdf/brdf.clh on the OpenCL device against formulas and quadrature in double: values,
// reciprocity, energy, the sampler's density and weights.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "luxfield/core/random.h"
#include "tests/render/brdf_by_formula.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;
using std::numbers::pi;

constexpr std::uint64_t kSeed = 20180701;

constexpr char kKernels[] = R"(
#include "luxfield/render/kernels/brdf/brdf.clh"
#include "luxfield/render/kernels/luminaire/lobe.clh"
typedef struct { float4 albedo, gloss, normal, eye; } Given;
Brdf MakeBrdf(Given s) {
  const Brdf brdf = {(int)s.albedo.w, s.albedo.xyz, s.gloss, s.normal.xyz, s.eye.xyz};
  return brdf;
}
__kernel void Evaluate(Given surface, __global const float4* light, int count,
                       __global float4* value) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const Brdf brdf = MakeBrdf(surface);
  value[k] = (float4)(EvaluateBrdf(&brdf, light[k].xyz), BrdfPdf(&brdf, light[k].xyz));
}
__kernel void Sample(Given surface, __global const float4* xi, int count,
                     __global float4* light) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const Brdf brdf = MakeBrdf(surface);
  float3 to_light;
  const bool valid = SampleBrdf(&brdf, xi[k].xy, xi[k].z, &to_light);
  light[k] = (float4)(to_light, valid ? 1.0f : 0.0f);
}
__kernel void Curvature(Given surface, __global const float4* light, float spread, int count,
                        __global float* value) {
  const int k = get_global_id(0);
  if (k >= count) return;
  const Brdf brdf = MakeBrdf(surface);
  value[k] = RelativeCurvature(&brdf, light[k].xyz, light[k].w, spread);
}
)";

cl_float4 ToFloat4(Vec3 v) {
  return {{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0}};
}
Vec3 ToVec3(const cl_float4& v) { return {v.s[0], v.s[1], v.s[2]}; }

struct DeviceSurface {
  cl_float4 albedo, gloss, normal, eye;
};

DeviceSurface Upload(const TestBrdf& brdf, Vec3 n, Vec3 eye) {
  return {brdf.AlbedoTexel(), brdf.GlossTexel(), ToFloat4(n), ToFloat4(eye)};
}

class BrdfTest : public testing::Test {
 protected:
  // f_r in xyz, the sampler's density in w.
  std::vector<cl_float4> Evaluate(const DeviceSurface& surface, const std::vector<Vec3>& light) {
    std::vector<cl_float4> directions(light.size());
    std::transform(light.begin(), light.end(), directions.begin(), ToFloat4);
    const auto input = Buffer::From(device_, directions);
    const Buffer output(device_, light.size() * sizeof(cl_float4));
    evaluate_.Set(surface, input, static_cast<cl_int>(light.size()), output)
        .Enqueue({light.size()}, {64})
        .Wait();
    return output.Download<cl_float4>();
  }

  // Directions; w = 1 where the sample is valid.
  std::vector<cl_float4> Sample(const DeviceSurface& surface, int count, std::uint32_t stream) {
    core::Random random(kSeed, stream);
    std::vector<cl_float4> xi(count);
    const auto below_one = [&] {
      return std::min(static_cast<float>(random.Uniform()), 0x1.fffffep-1f);
    };
    for (auto& x : xi) x = {{below_one(), below_one(), below_one(), 0}};
    // The ends of the ranges.
    for (int k = 0; k < 8; ++k)
      for (int c = 0; c < 3; ++c) xi[k].s[c] = (k >> c) & 1 ? 0x1.fffffep-1f : 0.0f;
    const auto input = Buffer::From(device_, xi);
    const Buffer output(device_, xi.size() * sizeof(cl_float4));
    sample_.Set(surface, input, count, output).Enqueue({xi.size()}, {64}).Wait();
    return output.Download<cl_float4>();
  }

  Device device_ = Device::Open();
  Program program_ = Program::BuildText(device_, kKernels, "tests/brdf.cl");
  Kernel evaluate_{program_, "Evaluate"}, sample_{program_, "Sample"};
};

// lobe.clh's bound where nothing is diffuse, seen along the normal: the lobe lies around it, and
// the light at the angle theta to it. h lies at theta / 2, v.h is its cosine. 0.01 and 4 are the
// shares below which the lobe counts as faint and what the rest of the integrand adds.
TEST_F(BrdfTest, CurvatureOfLobesIsTheBoundOfTheirNarrowLimits) {
  const Vec3 n{0, 0, 1};
  for (const bool phong : {false, true})
    for (const auto& [sharpness, spread] : {std::pair{0.1, 0.0}, {0.3, 0.0}, {0.1, 0.04}}) {
      const double exponent = 1 / (sharpness * sharpness) - 1;
      const TestBrdf brdf = phong ? TestBrdf::Phong({0, 0, 0}, {0.9, 0.9, 0.9}, exponent)
                                  : TestBrdf::Ggx({0.9, 0.9, 0.9}, 1, std::sqrt(sharpness));
      std::vector<cl_float4> lights;
      std::vector<double> expected;
      for (const double theta : {0.0, 0.05, 0.1, 0.2, 0.4, 0.8})
        for (const double radius : {0.0, 0.03, 0.15}) {
          lights.push_back({{static_cast<float>(std::sin(theta)), 0,
                             static_cast<float>(std::cos(theta)), static_cast<float>(radius)}});
          const double eye_cosine = std::cos(theta / 2),
                       width = phong ? sharpness : 2 * eye_cosine * sharpness,
                       angle = phong ? theta : eye_cosine * theta;
          const double x = (angle + spread) / width,
                       near = std::max(angle - spread - radius, 0.0) / width;
          const double lobe = phong ? std::exp(-x * x / 2) : std::pow(1 + x * x, -2),
                       laplacian = phong ? (2 + near * near) * std::exp(-near * near / 2)
                                         : (8 + 20 * near * near) * std::pow(1 + near * near, -4);
          expected.push_back(laplacian / (width * width * std::max(lobe, 0.01)) + 4);
        }
      const auto input = Buffer::From(device_, lights);
      const Buffer output(device_, lights.size() * sizeof(float));
      const auto count = static_cast<cl_int>(lights.size());
      Kernel(program_, "Curvature")
          .Set(Upload(brdf, n, n), input, static_cast<float>(spread), count, output)
          .Enqueue({64}, {64})
          .Wait();
      const auto found = output.Download<float>();
      for (std::size_t k = 0; k < expected.size(); ++k)
        EXPECT_NEAR(found[k], expected[k], 1e-3 * expected[k])
            << (phong ? "Phong " : "GGX ") << sharpness << ", light " << k;
    }
}

Vec3 Round(Vec3 v) { return ToVec3(ToFloat4(v)); }

Vec3 RandomDirection(core::Random& random) {
  return Normalized(Vec3{random.Normal(), random.Normal(), random.Normal()});
}

// At the angle `theta_deg` to n.
Vec3 Tilted(Vec3 n, Vec3 side, double theta_deg) {
  const Vec3 across = Normalized(Cross(n, side));
  return std::cos(theta_deg * pi / 180) * n + std::sin(theta_deg * pi / 180) * across;
}

std::vector<TestBrdf> Surfaces() {
  std::vector<TestBrdf> brdfs = {{kLambert, {0.2, 0.5, 0.8}, {}}};
  for (const double exponent : {0.0, 1.0, 32.0, 4096.0, 1e6})
    brdfs.push_back(TestBrdf::Phong({0.3, 0.2, 0.1}, {0.2, 0.5, 0.9}, exponent));
  brdfs.push_back(TestBrdf::Phong({0, 0, 0}, {1, 1, 1}, 200));
  for (const double roughness : {0.0, 0.05, 0.2, 0.5, 1.0})
    for (const double metallic : {0.0, 0.5, 1.0})
      brdfs.push_back(TestBrdf::Ggx({0.9, 0.6, 0.2}, metallic, roughness));
  for (const double roughness : {0.1, 0.6})
    brdfs.push_back(TestBrdf::Specular({0.1, 0.2, 0.4}, {0.5, 0.3, 0.1}, roughness));
  return brdfs;
}

std::string Name(const TestBrdf& b) {
  char text[80];
  std::snprintf(text, sizeof text, "%s, gloss %g %g %g %g",
                b.kind == kLambert ? "lambert"
                : b.kind == kPhong ? "phong"
                : b.kind == kGgx   ? "ggx"
                                   : "specular-glossiness",
                b.gloss[0], b.gloss[1], b.gloss[2], b.gloss[3]);
  return text;
}

// Half the width, in radians of the light's direction, of the narrowest part of the lobe.
double LobeWidth(const TestBrdf& b) {
  if (b.kind == kPhong) return 1 / std::sqrt(b.gloss[3] + 1);
  if (b.is_ggx()) return std::max(b.roughness() * b.roughness(), 1e-3);
  return 1;
}

// The mirrored eye's surroundings in polar coordinates whose radius a = w sinh(t) is fine near the
// axis: n_t x n_phi nodes of the midpoint rule over the sphere, with their solid angles.
struct PolarGrid {
  Vec3 axis, x, y;
  double width;
  int n_t, n_phi;

  PolarGrid(Vec3 axis_, double width_, int n_t_, int n_phi_)
      : axis(axis_), width(width_), n_t(n_t_), n_phi(n_phi_) {
    x = Normalized(Cross(axis, std::abs(axis.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    y = Cross(axis, x);
  }
  double t_max() const { return std::asinh(pi / width); }
  Vec3 Direction(int i, int j) const {
    const double a = width * std::sinh((i + 0.5) / n_t * t_max()), phi = 2 * pi * (j + 0.5) / n_phi;
    return std::cos(a) * axis + std::sin(a) * (std::cos(phi) * x + std::sin(phi) * y);
  }
  double SolidAngle(int i) const {
    const double a0 = width * std::sinh(double{1} * i / n_t * t_max()),
                 a1 = width * std::sinh((i + 1.0) / n_t * t_max());
    const double s0 = std::sin(a0 / 2), s1 = std::sin(a1 / 2);
    return 2 * (s1 * s1 - s0 * s0) * 2 * pi / n_phi;  // cos a0 - cos a1
  }
  // Cell of a direction.
  std::array<int, 2> Cell(Vec3 d) const {
    const double sine = Length(Cross(axis, d));
    const double a = std::atan2(sine, Dot(axis, d));
    double phi = std::atan2(Dot(d, y), Dot(d, x));
    if (phi < 0) phi += 2 * pi;
    return {std::min(static_cast<int>(std::asinh(a / width) / t_max() * n_t), n_t - 1),
            std::min(static_cast<int>(phi / (2 * pi) * n_phi), n_phi - 1)};
  }
};

Vec3 Mirrored(Vec3 n, Vec3 eye) { return 2 * Dot(n, eye) * n - eye; }

TEST_F(BrdfTest, MatchesTheFormulasInDouble) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  core::Random random(kSeed, 0);
  for (const TestBrdf& brdf : Surfaces()) {
    double worst = 0;
    for (const double theta : {0.0, 30.0, 70.0, 85.0, 89.0}) {
      const Vec3 n = Round(RandomDirection(random));
      const Vec3 eye = Round(Tilted(n, RandomDirection(random), theta));
      if (Dot(n, eye) < 1e-3) continue;
      std::vector<Vec3> light;
      const PolarGrid grid(Mirrored(n, eye), LobeWidth(brdf), 40, 10);
      for (int i = 0; i < grid.n_t; ++i)
        for (int j = 0; j < grid.n_phi; ++j) light.push_back(Round(grid.Direction(i, j)));
      const auto values = Evaluate(Upload(brdf, n, eye), light);
      double peak = 0;
      for (const Vec3& l : light)
        peak = std::max(peak, BrdfByFormula(brdf, n, eye, l)[1] * std::max(0.0, Dot(n, l)));
      for (std::size_t k = 0; k < light.size(); ++k) {
        if (Dot(n, light[k]) < 1e-3) continue;
        const auto expected = BrdfByFormula(brdf, n, eye, light[k]);
        for (int c = 0; c < 3; ++c) {
          ASSERT_TRUE(std::isfinite(values[k].s[c])) << Name(brdf);
          // Directions in float32 are right to 1e-7, beside a lobe as wide as LobeWidth.
          const double error = std::abs(values[k].s[c] - expected[c]) * Dot(n, light[k]) /
                               (expected[c] * Dot(n, light[k]) + 1e-3 * peak);
          worst = std::max(worst, error);
        }
      }
    }
    // Six digits in general; 1e-7 / width where the lobe is narrower than 0.1 rad, and h = l + v
    // loses what n.l + n.v is short of 1.
    const double bound = 2e-5 + 4e-6 / LobeWidth(brdf);
    std::printf("%s: worst error %.1e (bound %.1e)\n", Name(brdf).c_str(), worst, bound);
    EXPECT_LT(worst, bound) << Name(brdf);
  }
}

TEST_F(BrdfTest, IsReciprocal) {
  core::Random random(kSeed, 1);
  for (const TestBrdf& brdf : Surfaces()) {
    if (LobeWidth(brdf) < 0.02) continue;  // normalised float32 directions differ by more
    for (int k = 0; k < 50; ++k) {
      const Vec3 n = Round(RandomDirection(random));
      const Vec3 a = Round(Tilted(n, RandomDirection(random), 88 * random.Uniform()));
      const Vec3 b = Round(Tilted(n, RandomDirection(random), 88 * random.Uniform()));
      const auto f = Evaluate(Upload(brdf, n, a), {b})[0], g = Evaluate(Upload(brdf, n, b), {a})[0];
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(f.s[c], g.s[c], 1e-4 * f.s[c] + 1e-6) << Name(brdf);
    }
  }
}

// Integrals over the hemisphere of the light's direction, in double on a grid of its own: what a
// white furnace shows.
double Furnace(const TestBrdf& brdf, double theta_deg) {
  const Vec3 n{0, 0, 1}, eye = Tilted(n, {0, 1, 0}, theta_deg);
  const PolarGrid grid(Mirrored(n, eye), LobeWidth(brdf), 600, 240);
  double sum = 0;
  for (int i = 0; i < grid.n_t; ++i)
    for (int j = 0; j < grid.n_phi; ++j) {
      const Vec3 l = grid.Direction(i, j);
      sum += BrdfByFormula(brdf, n, eye, l)[0] * std::max(0.0, l.z) * grid.SolidAngle(i);
    }
  return sum;
}

TEST_F(BrdfTest, ReflectsNoMoreThanArrives) {
  constexpr double kQuadrature = 2e-3;
  double worst_metal = 0, worst_phong = 0, worst_dielectric = 0;
  for (const double theta : {0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0}) {
    for (const double roughness : {0.05, 0.1, 0.3, 0.6, 1.0}) {
      const double metal = Furnace(TestBrdf::Ggx({1, 1, 1}, 1, roughness), theta);
      const double dielectric = Furnace(TestBrdf::Ggx({1, 1, 1}, 0, roughness), theta);
      worst_metal = std::max(worst_metal, metal);
      worst_dielectric = std::max(worst_dielectric, dielectric);
      // Diffuse at most 1 - 0.04, specular at most what a metal would: glTF's mix bounds no more.
      EXPECT_LT(dielectric, 0.96 + metal + kQuadrature) << theta << " " << roughness;
      if (theta <= 45) {
        EXPECT_LT(dielectric, 1 + 0.02) << theta << " " << roughness;
      }
      // A smooth metal reflects all: single scattering loses nothing.
      if (roughness == 0.05 && theta <= 60) {
        EXPECT_NEAR(metal, 1, 5e-3) << theta;
      }
    }
    for (const double exponent : {0.0, 1.0, 10.0, 200.0, 4096.0})
      worst_phong = std::max(worst_phong,
                             Furnace(TestBrdf::Phong({0.3, 0, 0}, {0.7, 0, 0}, exponent), theta));
  }
  std::printf("white furnace, most that is reflected: metal %.4f, phong %.4f, dielectric %.4f\n",
              worst_metal, worst_phong, worst_dielectric);
  EXPECT_LT(worst_metal, 1 + kQuadrature);
  EXPECT_LT(worst_phong, 1 + kQuadrature);
}

// Chi-squared over cells of a polar grid about the mirrored eye, one more for samples below the
// surface; the density integrates to the share of valid samples; weights are bounded and their mean
// is what the surface reflects.
TEST_F(BrdfTest, SamplesWithTheirDensity) {
  constexpr int kSamples = 1 << 17, kRings = 10, kSectors = 8, kFine = 24;
  std::uint32_t stream = 10;
  for (const TestBrdf& brdf : Surfaces())
    for (const double theta : {0.0, 50.0, 80.0, 88.0}) {
      // A lobe 2 alpha by 2 alpha cos(theta) wide: quadrature in float32 directions ends here.
      if (LobeWidth(brdf) < 0.01 && theta > 80) continue;
      core::Random random(kSeed, ++stream);
      const Vec3 n = Round(RandomDirection(random));
      const Vec3 eye = Round(Tilted(n, RandomDirection(random), theta));
      const auto surface = Upload(brdf, n, eye);
      const double width = LobeWidth(brdf) * (brdf.is_ggx() ? std::cos(theta * pi / 180) : 1);
      const PolarGrid cells(Mirrored(n, eye), width, kRings, kSectors),
          fine(Mirrored(n, eye), width, kRings * kFine, kSectors * kFine);
      std::vector<Vec3> light;
      for (int i = 0; i < fine.n_t; ++i)
        for (int j = 0; j < fine.n_phi; ++j) light.push_back(fine.Direction(i, j));
      const auto density = Evaluate(surface, light);
      std::vector<double> expected(kRings * kSectors + 1);
      double total = 0, reflected = 0;
      for (int i = 0; i < fine.n_t; ++i)
        for (int j = 0; j < fine.n_phi; ++j) {
          const auto& value = density[i * fine.n_phi + j];
          const double share = value.s[3] * fine.SolidAngle(i);
          expected[i / kFine * kSectors + j / kFine] += share;
          total += share;
          reflected +=
              value.s[1] * fine.SolidAngle(i) * std::max(0.0, Dot(n, light[i * fine.n_phi + j]));
        }
      expected.back() = 1 - total;

      const auto samples = Sample(surface, kSamples, ++stream);
      std::vector<Vec3> valid;
      std::vector<double> counts(expected.size());
      for (const auto& sample : samples) {
        ASSERT_TRUE(std::isfinite(sample.s[0]) && std::isfinite(sample.s[2])) << Name(brdf);
        if (sample.s[3] == 0) {
          ++counts.back();
          continue;
        }
        const Vec3 d = ToVec3(sample);
        ASSERT_NEAR(Length(d), 1, 1e-5);
        const auto [ring, sector] = cells.Cell(d);
        ++counts[ring * kSectors + sector];
        valid.push_back(d);
      }
      const std::string what = Name(brdf) + ", eye at " + std::to_string(theta);
      const double invalid = counts.back() / kSamples;
      // Quadrature of a density with a step at the horizon.
      EXPECT_NEAR(expected.back(), invalid, 4e-3 + 5 * std::sqrt(invalid / kSamples)) << what;

      // The quadrature's own error is 1e-3 of a cell: it adds N 1e-6 per cell to chi^2.
      double chi_square = 0, pooled_expected = 0, pooled = 0;
      int freedom = -1;
      const double slack = 4e-3;
      for (std::size_t k = 0; k + 1 < counts.size(); ++k) {
        pooled_expected += expected[k] * kSamples;
        pooled += counts[k];
        if (pooled_expected < 20) continue;
        const double excess =
            std::max(0.0, std::abs(pooled - pooled_expected) - slack * pooled_expected);
        chi_square += excess * excess / pooled_expected;
        ++freedom;
        pooled_expected = pooled = 0;
      }
      EXPECT_LT(chi_square, freedom + 5 * std::sqrt(2.0 * std::max(freedom, 1)) + 5) << what;

      const auto values = Evaluate(surface, valid);
      double sum = 0, square = 0, largest = 0;
      for (std::size_t k = 0; k < valid.size(); ++k) {
        ASSERT_GT(values[k].s[3], 0) << what;
        for (int c = 0; c < 3; ++c)
          largest = std::max(largest, values[k].s[c] * Dot(n, valid[k]) / values[k].s[3]);
        const double weight = values[k].s[1] * Dot(n, valid[k]) / values[k].s[3];
        sum += weight;
        square += weight * weight;
      }
      EXPECT_LT(largest, (brdf.kind == kPhong ? 4 * (brdf.gloss[3] + 2) / (brdf.gloss[3] + 1) : 4) *
                             (1 + 1e-3))
          << what;
      const double mean = sum / kSamples;
      const double error = std::sqrt((square / kSamples - mean * mean) / kSamples);
      EXPECT_NEAR(mean, reflected, 5 * error + 4e-3 * reflected) << what;
    }
}

}  // namespace
}  // namespace luxfield::render
