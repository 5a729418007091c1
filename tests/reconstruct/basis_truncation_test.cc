#include "luxfield/reconstruct/budget/basis_truncation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/quadrature.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;

constexpr double kSpacing_m = 0.02;

LightField Field(const Basis& basis, int width, int height, int channels = 1) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(basis, width, height, kSpacing_m);
  g.lattice = {3, 2, -0.03, 0.02, 0.02, 0.02};
  g.channels = channels;
  return LightField(g);
}

// A broad bump, other at every texel.
LightField Bump(const Basis& basis, int width, int height) {
  LightField field = Field(basis, width, height);
  const auto& grid = field.geometry.grid;
  for (int m = 0; m < grid.count(); ++m) {
    const auto u = grid.centre(m % width, m / width);
    auto image = field.image(m, 0);
    for (std::size_t p = 0; p < image.size(); ++p) {
      const double x = u.x / kSpacing_m - 0.3 + 0.1 * static_cast<double>(p),
                   y = u.y / kSpacing_m + 0.2;
      image[p] = static_cast<float>((1 + static_cast<double>(p)) * std::exp(-(x * x + y * y) / 4));
    }
  }
  return field;
}

const Term kFlux{1, {lightfield::FluxWeights, {}}};

Term Ray(lightfield::Vec2 u_m, lightfield::Vec2 s_m) {
  return {
      1,
      {[=](const lightfield::LuminaireGeometry& g) { return RadianceWeights(g, u_m, s_m); }, s_m}};
}

// Fine functions four a spacing hold those of `bspline2`: the two-scale relation (1, 3, 3, 1)/4
// twice. Seen through the filters each is itself again.
TEST(SpotAxis, SeesABasisFunctionAsItself) {
  constexpr int kCount = 6, kFiner = 4;
  const SpotAxis axis(Basis::Make(BasisKind::kBspline2), FilterKind::kBasis, kCount, kFiner, 0.25);
  ASSERT_EQ(axis.seen.cols(), kFiner * (kCount + 2) - 2);
  const std::vector<double> mask = {0.25, 0.75, 0.75, 0.25};
  Eigen::MatrixXd refine = Eigen::MatrixXd::Zero(axis.seen.cols(), kCount);
  for (int i = 0; i < kCount; ++i)
    for (std::size_t a = 0; a < mask.size(); ++a)
      for (std::size_t b = 0; b < mask.size(); ++b)
        refine(kFiner * i + static_cast<int>(2 * a + b), i) += mask[a] * mask[b];
  const Eigen::MatrixXd itself = axis.resolved * refine;
  EXPECT_LT((itself - Eigen::MatrixXd::Identity(kCount, kCount)).cwiseAbs().maxCoeff(), 1e-12);
}

// Behind dual filters of a = 1/2 an even lamp of 1 is seen as the dual function's integral, 9/8.
TEST(SpotAxis, SeesAnEvenLampBehindDualFilters) {
  const SpotAxis axis(Basis::Make(BasisKind::kQuadratic, 0.5), FilterKind::kDual, 8, 3, 0.5);
  const Eigen::VectorXd seen = axis.resolved * Eigen::VectorXd::Ones(axis.seen.cols());
  for (int i = 1; i < 7; ++i) EXPECT_NEAR(seen(i), 9.0 / 8, 1e-12);  // the outer ones see the edge
}

// What is known exactly has no variance, and its mean is the measured value: forms that the filters
// see themselves.
TEST(SpotPosterior, KnowsWhatTheFiltersSaw) {
  const SpotAxis axis(Basis::Make(BasisKind::kBspline2), FilterKind::kBasis, 5, 4, 0.25);
  Eigen::MatrixXd c(5, 5);
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) c(i, j) = std::exp(-0.5 * ((i - 2) * (i - 2) + (j - 1) * (j - 1)));
  const SpotPosterior posterior(axis, axis, c, Eigen::MatrixXd::Zero(5, 5));
  const Eigen::MatrixXd e = axis.overlap * c * axis.overlap.transpose();
  for (int i = 0; i < 5; ++i) {
    const Moments seen = posterior.Of(axis.seen.row(i).transpose() * axis.seen.row(2));
    EXPECT_NEAR(seen.mean, e(i, 2), 1e-5 * e.maxCoeff());
    EXPECT_LT(std::sqrt(seen.variance), 1e-4 * e.maxCoeff());
  }
  // A single place between them is not known.
  Eigen::MatrixXd place = Eigen::MatrixXd::Zero(axis.seen.cols(), axis.seen.cols());
  place(axis.seen.cols() / 2, axis.seen.cols() / 2) = 1;
  EXPECT_GT(posterior.Of(place).variance, 0);
}

// With noise the posterior believes its data less.
TEST(SpotPosterior, NoiseMakesItLessSure) {
  const SpotAxis axis(Basis::Make(BasisKind::kBspline2), FilterKind::kBasis, 5, 4, 0.25);
  Eigen::MatrixXd c = Eigen::MatrixXd::Constant(5, 5, 0.1), whole;
  c(2, 2) = 1;
  whole = Eigen::MatrixXd::Ones(axis.seen.cols(), axis.seen.cols());
  double before = 0;
  for (const double noise : {1e-6, 1e-4, 1e-2}) {
    const SpotPosterior posterior(axis, axis, c, Eigen::MatrixXd::Constant(5, 5, noise * noise));
    const double now = posterior.Of(whole).variance;
    EXPECT_GT(now, before) << noise;
    before = now;
  }
}

TEST(BasisTruncation, IsLargerForFinerLamps) {
  for (const bool dual : {false, true}) {
    const LightField field =
        Bump(Basis::Make(dual ? BasisKind::kQuadratic : BasisKind::kBspline2), 7, 6);
    const auto filter = dual ? FilterKind::kDual : FilterKind::kBasis;
    const auto relative = [&](double smallest, const Term& term) {
      const BasisTruncation truncation(field, filter, {smallest * kSpacing_m});
      return truncation.Sigma({term}) / std::abs(Apply(term.form.weights(field.geometry), field));
    };
    const Term ray = Ray({0.003, -0.004}, {0.01, 0.01});
    EXPECT_GT(relative(0.25, ray), relative(1, ray));
    EXPECT_GT(relative(0.25, ray), 1e-3);
  }
}

// The sigma of a multiple is the multiple of sigma, of terms that cancel nothing, at any
// brightness.
TEST(BasisTruncation, ScalesWithTheLampAndAddsTerms) {
  const LightField field = Bump(Basis::Make(BasisKind::kBspline2), 6, 5);
  const TruncationOptions options{0.25 * kSpacing_m};
  const BasisTruncation truncation(field, FilterKind::kBasis, options);
  const double sigma = truncation.Sigma({kFlux});
  EXPECT_GT(sigma, 0);
  for (const float brightness : {0x1p-60f, 0x1p60f}) {
    LightField other = field;
    for (float& c : other.data) c *= brightness;
    const BasisTruncation of_other(other, FilterKind::kBasis, options);
    EXPECT_NEAR(of_other.Sigma({kFlux}) / (brightness * sigma), 1, 1e-6) << brightness;
  }
  EXPECT_NEAR(truncation.Sigma({kFlux, {-1, kFlux.form}}), 0, 1e-9 * sigma);
  EXPECT_NEAR(truncation.Sigma({{3, kFlux.form}}), 3 * sigma, 1e-9 * sigma);
}

TEST(BasisTruncation, ThreeChannelsAreTheirLuminance) {
  const LightField one = Bump(Basis::Make(BasisKind::kBspline2), 6, 5);
  LightField three = Field(one.geometry.grid.basis, 6, 5, 3);
  for (int m = 0; m < one.geometry.grid.count(); ++m)
    for (int channel = 0; channel < 3; ++channel)
      std::copy(one.image(m, 0).begin(), one.image(m, 0).end(), three.image(m, channel).begin());
  const TruncationOptions options{0.25 * kSpacing_m};
  const Term ray = Ray({0.003, -0.004}, {0.01, 0.01});
  for (const Term& term : {kFlux, ray})
    EXPECT_NEAR(BasisTruncation(three, FilterKind::kBasis, options).Sigma({term}) /
                    BasisTruncation(one, FilterKind::kBasis, options).Sigma({term}),
                1, 1e-5);
}

TEST(BasisTruncation, NothingIsLostOfADarkLamp) {
  const LightField dark = Field(Basis::Make(BasisKind::kBspline2), 6, 5);
  const BasisTruncation truncation(dark, FilterKind::kBasis, {0.25 * kSpacing_m});
  EXPECT_EQ(truncation.Sigma({kFlux}), 0);
  EXPECT_EQ(truncation.Sigma({Ray({0, 0}, {0.01, 0.01})}), 0);
  EXPECT_EQ(truncation.Sigma({Ray({0, 0}, {5, 5})}), 0);  // beside the lattice
}

TEST(BasisTruncation, RefusesByNameWhatTakesTooLong) {
  const auto refused = [](int filters, double smallest) -> std::string {
    try {
      BasisTruncation(Field(Basis::Make(BasisKind::kBspline2), filters, filters),
                      FilterKind::kBasis, {smallest * kSpacing_m});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refused(50, 0.5), testing::HasSubstr("smallest_spot_m"));
  EXPECT_THAT(refused(6, 0.01), testing::HasSubstr("smallest_spot_m"));
}

}  // namespace
}  // namespace luxfield::reconstruct
