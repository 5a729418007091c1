#include "luxfield/reconstruct/solve/irradiance_metric.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using lightfield::LightField;

constexpr std::uint64_t kSeed = 2516;

// Nothing of it is the same along both axes or centred, so that no mix-up cancels.
lightfield::LuminaireGeometry SmallGeometry(const char* basis, int channels = 1) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.5;
  geometry.grid.basis = lightfield::Basis::FromName(basis);
  geometry.grid.width = 3;
  geometry.grid.height = 2;
  geometry.grid.spacing_m = 0.03;
  geometry.grid.u0_m = -0.05;
  geometry.grid.v0_m = -0.02;
  geometry.lattice = {5, 4, -0.04, 0.05, 0.02, 0.026};
  geometry.channels = channels;
  return geometry;
}

// Normal about `mean`, in units that floats square badly.
LightField RandomField(const lightfield::LuminaireGeometry& geometry, double mean, double unit) {
  LightField field(geometry);
  core::Random random(kSeed, geometry.value_count());
  for (float& c : field.data) c = static_cast<float>(unit * (random.Normal() + mean));
  return field;
}

// Nodes and weights of the Gauss-Legendre rule on [0, 1], the roots of P_n by Newton's method.
std::vector<std::pair<double, double>> GaussLegendre(int n) {
  std::vector<std::pair<double, double>> rule;
  for (int k = 1; k <= n; ++k) {
    double x = std::cos(M_PI * (k - 0.25) / (n + 0.5)), slope = 0;
    for (int step = 0; step < 50; ++step) {
      double p0 = 1, p1 = x;
      for (int m = 2; m <= n; ++m) {
        const double p2 = ((2 * m - 1) * x * p1 - (m - 1) * p0) / m;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (p0 - x * p1) / (1 - x * x);
      x -= p1 / slope;
    }
    rule.emplace_back(0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

// The whole objective as half a quadratic form in double, unknown m * texels + p: lines are walked
// in small steps over F, texel by texel, which knows nothing of taps.
class DenseProblem {
 public:
  DenseProblem(const LightField& start, double weight) : geometry_(start.geometry) {
    const auto& [basis, width, height, u0, v0, h] = geometry_.grid;
    const auto& lattice = geometry_.lattice;
    const int texels = static_cast<int>(geometry_.plane_size()), count = geometry_.grid.count();
    start_ = VectorXd(count * texels);
    for (int k = 0; k < start_.size(); ++k) start_(k) = start.data[k];
    hessian_ = MatrixXd::Zero(start_.size(), start_.size());
    constexpr int kAround = 12, kSteps = 1200;  // texels of darkness, steps of an axis
    for (const auto& [slope, share] : GaussLegendre(6)) {
      // What function i has along the line through the middle of column a in column x.
      const auto along = [&, slope = slope](int functions, double first, int lines, double from,
                                            double side) {
        std::vector<MatrixXd> found(functions, MatrixXd::Zero(lines + 2 * kAround, lines));
        for (int a = -kAround; a < lines + kAround; ++a)
          for (int step = 0; step < kSteps; ++step) {
            const double x = (step + 0.5) * (functions + basis.cells - 1) / kSteps,
                         crossed = from + (a + 0.5) * side + slope * (first + x * h);
            const int texel = static_cast<int>(std::floor((crossed - from) / side));
            if (texel < 0 || texel >= lines) continue;
            for (int i = 0; i < functions; ++i)
              found[i](a + kAround, texel) +=
                  basis.Value(x - i) * (functions + basis.cells - 1) / kSteps;
          }
        return found;
      };
      const auto u = along(width, u0, lattice.width, lattice.s0_m, lattice.ds_m),
                 v = along(height, v0, lattice.height, lattice.t1_m, -lattice.dt_m);
      for (int b = 0; b < lattice.height + 2 * kAround; ++b)
        for (int a = 0; a < lattice.width + 2 * kAround; ++a) {
          VectorXd line(start_.size());
          for (int m = 0; m < count; ++m)
            for (int p = 0; p < texels; ++p)
              line(m * texels + p) =
                  u[m % width](a, p % lattice.width) * v[m / width](b, p / lattice.width);
          hessian_ += share * line * line.transpose();
        }
    }
    for (int m = 0; m < count; ++m)
      for (int n = 0; n < count; ++n)
        for (int p = 0; p < texels; ++p)
          hessian_(m * texels + p, n * texels + p) +=
              weight * basis.Gram(m % width - n % width) * basis.Gram(m / width - n / width);
  }

  VectorXd Gradient(const VectorXd& c) const { return hessian_ * (c - start_); }
  double Objective(const VectorXd& c) const { return 0.5 * (c - start_).dot(Gradient(c)); }

  // The minimum by exact moves of light from one coefficient of a texel to another.
  VectorXd Minimise() const {
    const int texels = static_cast<int>(geometry_.plane_size()), count = geometry_.grid.count();
    VectorXd c(start_.size());
    for (int p = 0; p < texels; ++p) {
      double flux = 0;
      for (int m = 0; m < count; ++m) flux += start_(m * texels + p);
      for (int m = 0; m < count; ++m) c(m * texels + p) = std::max(flux, 0.0) / count;
    }
    VectorXd gradient = Gradient(c);
    for (int sweep = 0; sweep < 4000; ++sweep) {
      double moved = 0;
      for (int p = 0; p < texels; ++p)
        for (int m = 0; m < count; ++m)
          for (int n = 0; n < m; ++n) {
            const int x = m * texels + p, y = n * texels + p;
            const double bend = hessian_(x, x) + hessian_(y, y) - 2 * hessian_(x, y),
                         by = std::clamp((gradient(y) - gradient(x)) / bend, -c(x), c(y));
            if (by == 0) continue;
            c(x) += by;
            c(y) -= by;
            gradient += by * (hessian_.col(x) - hessian_.col(y));
            moved = std::max(moved, std::abs(by));
          }
      if (moved < 1e-12 * start_.cwiseAbs().maxCoeff()) break;
    }
    return c;
  }

  const MatrixXd& hessian() const { return hessian_; }

 private:
  lightfield::LuminaireGeometry geometry_;
  MatrixXd hessian_;
  VectorXd start_;
};

class IrradianceMetric : public testing::TestWithParam<const char*> {};

// Against an independent dense solution, and by the Karush-Kuhn-Tucker conditions.
TEST_P(IrradianceMetric, IsTheNearestInIrradiance) {
  const LightField start = RandomField(SmallGeometry(GetParam()), 0.3, 1e7);
  constexpr double kWeight = 0.3, kTolerance = 2e-6;
  LightField field = start;
  const NonNegativeSummary summary = ProjectByIrradiance({kWeight, kTolerance, 20000}, &field);
  EXPECT_EQ(summary.unconverged, 0u);
  EXPECT_GT(summary.pixels, 15u);
  const DenseProblem problem(start, kWeight);
  VectorXd c(field.data.size());
  double scale = 0;
  for (int k = 0; k < c.size(); ++k) {
    c(k) = field.data[k];
    scale = std::max(scale, std::abs(double{start.data[k]}));
  }
  const VectorXd best = problem.Minimise();
  // The objective is flat about its minimum. Lines are walked in steps, which miss a border of a
  // texel by half a step: weights are off by 1 / 1200 of their axis at most, times 5 / 2 cells.
  const double least = problem.Objective(best), found = problem.Objective(c);
  std::printf("%s: objective %.9g, dense solution %.9g, C within %.2g of the largest, %d steps\n",
              GetParam(), found / (scale * scale), least / (scale * scale),
              (c - best).cwiseAbs().maxCoeff() / scale, summary.iterations);
  EXPECT_NEAR(found, least, 1e-5 * least);
  EXPECT_GT(found, 0.01 * scale * scale);
  EXPECT_LT((c - best).norm(), 0.01 * best.norm());
  const VectorXd gradient = problem.Gradient(c);
  const int texels = static_cast<int>(start.geometry.plane_size());
  for (int p = 0; p < texels; ++p) {
    double flux = 0, kept = 0, lowest = std::numeric_limits<double>::max();
    for (int k = p; k < c.size(); k += texels) {
      EXPECT_GE(c(k), 0);
      flux += start.data[k];
      kept += c(k);
      lowest = std::min(lowest, gradient(k));
    }
    EXPECT_NEAR(kept, std::max(flux, 0.0), 1e-6 * scale);
    // No light would gain by going elsewhere in its texel.
    for (int k = p; k < c.size(); k += texels)
      EXPECT_LE(std::min(c(k), gradient(k) - lowest), 5e-3 * scale) << "texel " << p;
  }
}
INSTANTIATE_TEST_SUITE_P(Bases, IrradianceMetric,
                         testing::Values("box", "bilinear", "quadratic", "bspline2"));

// As the weight of the field grows, the metric becomes that of non_negative.h.
TEST(ProjectByIrradiance, TendsToTheMetricOfCoefficients) {
  const LightField start = RandomField(SmallGeometry("bspline2"), 0.3, 1);
  LightField field = start, nearest = start;
  ProjectByIrradiance({1e5, 1e-6, 20000}, &field);
  std::vector<float*> images;
  for (int m = 0; m < 6; ++m) images.push_back(nearest.image(m, 0).data());
  ProjectNonNegative(GramSolver(start.geometry.grid), images.data(), start.geometry.plane_size(),
                     {true, false, 1e-6, 20000});
  for (std::size_t k = 0; k < start.data.size(); ++k)
    EXPECT_NEAR(field.data[k], nearest.data[k], 2e-4) << k;
}

TEST(ProjectByIrradiance, TakesChannelsOneByOneAndLeavesWhatIsNotNegative) {
  const LightField start = RandomField(SmallGeometry("bilinear", 3), 0.5, 1);
  LightField field = start;
  for (int m = 0; m < 6; ++m)
    for (float& c : field.image(m, 1)) c = std::abs(c);
  const LightField mixed = field;
  ProjectByIrradiance({}, &field);
  for (int m = 0; m < 6; ++m)
    for (std::size_t p = 0; p < mixed.geometry.plane_size(); ++p) {
      EXPECT_EQ(field.image(m, 1)[p], mixed.image(m, 1)[p]);
      EXPECT_GE(field.image(m, 0)[p], 0);
      EXPECT_GE(field.image(m, 2)[p], 0);
    }
  LightField alone(SmallGeometry("bilinear"));
  for (int m = 0; m < 6; ++m) std::ranges::copy(start.image(m, 2), alone.image(m, 0).begin());
  ProjectByIrradiance({}, &alone);
  for (int m = 0; m < 6; ++m)
    for (std::size_t p = 0; p < alone.geometry.plane_size(); ++p)
      EXPECT_EQ(alone.image(m, 0)[p], field.image(m, 2)[p]);
}

TEST(ProjectByIrradiance, DarkTexelsAndBadInput) {
  LightField field = RandomField(SmallGeometry("bspline2"), 0.5, 1);
  for (int m = 0; m < 6; ++m) field.image(m, 0)[7] = m == 0 ? -6.0f : 1.0f;  // sum -1
  const NonNegativeSummary summary = ProjectByIrradiance({0.3, 1e-3, 1}, &field);
  EXPECT_EQ(summary.unconverged, summary.pixels);
  EXPECT_EQ(summary.metric, NonNegativeMetric::kIrradiance);
  for (int m = 0; m < 6; ++m) EXPECT_EQ(field.image(m, 0)[7], 0);
  EXPECT_THROW(ProjectByIrradiance({0, 1e-3, 100}, &field), InputError);
  field.image(2, 0)[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(ProjectByIrradiance({}, &field), InputError);
  EXPECT_THROW(NonNegativeMetricFromName("radiance"), InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
