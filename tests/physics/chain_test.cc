// The whole chain in an ideal lab: simulated rig -> session -> merge -> registration -> Gram solve
// -> picture. A lamp in the span of the basis must come back; where it cannot (pixels that straddle
// texels, texels off the sensor), the error must be the one that the geometry predicts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "ideal_rig.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/renderer.h"
#include "luxfield/rig/homography.h"

namespace luxfield::physics {
namespace {

using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Measurements;

constexpr std::uint64_t kSeed = 20140222;

class IdealChain : public testing::Test {
 protected:
  void SetUp() override { std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed)); }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  // RunIdeal, with the folder removed at the end of the test.
  IdealRun Run(const IdealRig& rig, const LightField& lamp) {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
    IdealRun run = RunIdeal(rig, lamp);
    folder_ = run.truth_file.parent_path();
    return run;
  }

  void Report(const std::string& figure, double value) {
    const std::string text = fmt::format("{:.3g}", value);
    std::printf("%s %s\n", figure.c_str(), text.c_str());
    RecordProperty(figure, text);
  }

 private:
  std::filesystem::path folder_;
};

double Range(const LightField& field) {
  const auto [least, most] = std::minmax_element(field.data.begin(), field.data.end());
  return double{*most} / *least;
}

// Irradiance of a ground plane, a wall and a slanted board 0.4 to 6 m in front of the lamp.
core::Image ExactPicture(const std::filesystem::path& light_field) {
  scene::Scene scene;
  scene.geometry.materials = {{"grey", {0.5f, 0.5f, 0.5f}, -1}};
  scene::AppendQuad({-4, -0.6, 0.4}, {8, 0, 0}, {0, 0, 6}, 0, scene.geometry);
  scene::AppendQuad({-4, -0.6, 6}, {8, 0, 0}, {0, 4, 0}, 0, scene.geometry);
  scene::AppendQuad({0.1, -0.3, 0.9}, {0.4, 0, 0.3}, {0, 0.5, 0.1}, 0, scene.geometry);
  scene.camera = scene::Camera::LookAt({-1.2, 1.2, -0.5}, {0, -0.1, 2.5}, {0, 1, 0}, 60, 96, 72);
  scene.luminaires = {{"lamp", light_field, {}, {}, 1}};
  render::RenderOptions options;
  options.estimator = "exact";
  options.shadows = render::Shadows::kNone;
  render::LitScene lit(render::Device::Open(), scene);
  return render::Renderer(lit, options).Render().irradiance;
}

struct SpanCase {
  const char* name;
  BasisKind basis;
  double a = 0.5;
  bool dual = false;
  int channels = 1;
  double filter_scale = 1;
};

class InTheSpan : public IdealChain, public testing::WithParamInterface<SpanCase> {};

// Float32 is the only error: frames, merged pixels and irradiance are rounded to 6e-8 each and the
// Gram solve amplifies by 12 (rms) to 56 (worst). A picture averages C over its windows.
TEST_P(InTheSpan, TheLampComesBack) {
  const SpanCase& c = GetParam();
  IdealRig rig;
  rig.name = c.name;
  rig.basis = lightfield::Basis::Make(c.basis, c.a);
  rig.dual = c.dual;
  rig.channels = c.channels;
  rig.filter_scale = c.filter_scale;
  const LightField lamp = StructuredLamp(rig, kSeed);
  ASSERT_GT(Range(lamp), 1e5);
  const IdealRun run = Run(rig, lamp);

  const auto& report = run.chain.reconstruction;
  for (const auto& position : run.chain.measurements.positions)
    for (const auto mask : position.mask) ASSERT_EQ(mask & lightfield::kUnknownMask, 0u);
  if (!rig.dual) {
    EXPECT_LT(planning::IrradianceError(run.chain.measurements, run.true_irradiance).rel_rmse,
              1e-6);
  }
  const double rmse = planning::CompareWithTruth(report.coefficients.data, lamp.data).rel_rmse,
               l2 = planning::CompareWithTruth(report.coefficients.data, lamp.data).rel_l2;
  Report("C_rmse_over_mean", rmse);
  Report("C_rmse_over_rms", l2);
  EXPECT_LT(rmse, 1e-4);

  const core::Image truth = ExactPicture(run.truth_file),
                    reconstructed = ExactPicture(run.reconstructed_file);
  const auto difference = core::Compare(reconstructed, truth);
  ASSERT_GT(difference.mean_reference, 0);
  Report("irradiance_rmse_over_mean", difference.rel_rmse);
  EXPECT_LT(difference.rel_rmse, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Lensless, InTheSpan,
    testing::Values(SpanCase{"bspline2", BasisKind::kBspline2},
                    SpanCase{"bspline2_full_print", BasisKind::kBspline2, 0, false, 1, 16.0 / 9},
                    SpanCase{"bspline2_rgb", BasisKind::kBspline2, 0, false, 3},
                    SpanCase{"quadratic", BasisKind::kQuadratic},
                    SpanCase{"bilinear", BasisKind::kBilinear}, SpanCase{"box", BasisKind::kBox},
                    SpanCase{"quadratic_dual", BasisKind::kQuadratic, 0.5, true},
                    SpanCase{"bilinear_dual", BasisKind::kBilinear, 0, true}),
    [](const auto& case_) { return std::string(case_.param.name); });

// E (texel centres of `image`) with neighbours outside the lattice dark, as the lamp is there.
double At(const std::vector<float>& image, const lightfield::Lattice& lattice, int row,
          int column) {
  if (row < 0 || column < 0 || row >= lattice.height || column >= lattice.width) return 0;
  return image[static_cast<std::size_t>(row) * lattice.width + column];
}

// Both axes' second differences: what a blur that is narrow against a texel adds, per unit of the
// share that leaks over each edge.
double SecondDifferences(const std::vector<float>& image, const lightfield::Lattice& lattice,
                         int row, int column) {
  return At(image, lattice, row - 1, column) + At(image, lattice, row + 1, column) +
         At(image, lattice, row, column - 1) + At(image, lattice, row, column + 1) -
         4 * At(image, lattice, row, column);
}

// A spacing of 4.3 pixels: from one position to the next, texel edges move through the pixels. A
// pixel cut by a texel's edge into shares f and 1 - f holds the mean of both sides, and the texel
// takes the share f of it: f (1 - f) / r of each neighbour (r pixels per texel) enters in place of
// its own light. Nothing else may go wrong.
TEST_F(IdealChain, UnalignedSpacingLeaksOverTexelEdgesAsPredicted) {
  double previous_error = INFINITY;
  for (const int resolution : {1, 2, 4}) {
    IdealRig rig;
    rig.name = "unaligned";
    rig.grid_width = rig.grid_height = 5;  // a filter on the axis: the lab's samples are aligned
    rig.spacing_px = 4.3;
    rig.resolution = resolution;
    const LightField lamp = StructuredLamp(rig, kSeed);
    const IdealRun run = Run(rig, lamp);
    const auto& geometry = lamp.geometry;
    const auto& lattice = geometry.lattice;

    const double per_texel = rig.texel_px * resolution;
    const auto figure = [&](const char* name) {
      return fmt::format("{}_at_{}_pixels_per_texel", name, per_texel);
    };
    const auto leak = [&](double centre_m) {
      const double edge = centre_m / IdealRig::kPixel_m * resolution;
      const double f = edge - std::floor(edge);
      return f * (1 - f) / per_texel;
    };
    double worst = 0, brightest = 0, largest_leak = 0;
    for (int m = 0; m < geometry.grid.count(); ++m) {
      const auto centre = geometry.grid.centre(m % rig.grid_width, m / rig.grid_width);
      const double ks = leak(centre.x), kt = leak(centre.y);
      largest_leak = std::max({largest_leak, ks, kt});
      const auto& truth = run.true_irradiance[m];
      for (int row = 0; row < lattice.height; ++row)
        for (int column = 0; column < lattice.width; ++column) {
          double predicted = 0;
          for (const int dr : {-1, 0, 1})
            for (const int dc : {-1, 0, 1})
              predicted += (dr == 0 ? 1 - 2 * kt : kt) * (dc == 0 ? 1 - 2 * ks : ks) *
                           At(truth, lattice, row + dr, column + dc);
          const double measured =
              At(run.chain.measurements.positions[m].irradiance, lattice, row, column);
          worst = std::max(worst, std::abs(measured - predicted));
          brightest = std::max(
              brightest, double{truth[static_cast<std::size_t>(row) * lattice.width + column]});
        }
    }
    Report(figure("unaligned_deviation_from_prediction"), worst / brightest);
    // Float32 frames, merged pixels and texels.
    EXPECT_LT(worst / brightest, 3e-7);
    EXPECT_LE(largest_leak, 0.25 / per_texel);
    EXPECT_GT(largest_leak, 0.1 / per_texel);

    const double error =
        planning::CompareWithTruth(run.chain.reconstruction.coefficients.data, lamp.data).rel_l2;
    Report(figure("unaligned_C_error"), error);
    // Were all positions to leak the most, 1 / (4 r), C would be blurred like E, and the second
    // differences of two axes are at most 8 in the L2 norm.
    EXPECT_LT(error, 2 / per_texel);
    EXPECT_LT(error, 0.8 * previous_error);
    previous_error = error;
  }
}

// Where images do not vary over s no share of a neighbour does harm: unaligned spacings and the
// homography of an oblique camera must then give C back (off the lattice's border, beyond which the
// lamp is dark).
TEST_F(IdealChain, FlatImagesSurviveAnyRegistration) {
  IdealRig unaligned, reflector;
  unaligned.name = "flat_unaligned";
  unaligned.spacing_px = 3.7;
  reflector.name = "flat_reflector";
  reflector.corners = {{{-1.08, 1.1}, {1.4, 1.2}, {1.2, -1.1}, {-1.1, -1.5}}};
  for (const IdealRig& rig : {unaligned, reflector}) {
    const LightField lamp = FlatLamp(rig, 1e6, kSeed);
    const IdealRun run = Run(rig, lamp);
    const auto& lattice = lamp.geometry.lattice;
    double worst = 0;
    constexpr int kBorder = 3;
    for (int m = 0; m < lamp.geometry.grid.count(); ++m)
      for (int row = kBorder; row < lattice.height - kBorder; ++row)
        for (int column = kBorder; column < lattice.width - kBorder; ++column) {
          const auto k = static_cast<std::size_t>(row) * lattice.width + column;
          const double c = lamp.image(m, 0)[k];
          worst = std::max(worst,
                           std::abs(run.chain.reconstruction.coefficients.image(m, 0)[k] / c - 1));
        }
    Report(rig.name + "_worst", worst);
    EXPECT_LT(worst, 1e-4);
  }
}

// Through the homography every pixel is a quadrilateral that ignores the texels' edges. Along an
// axis, with a and b the components of a pixel's two edges and p the mean pixel, light is blurred
// by the lab's linear interpolation between samples p apart (an edge becomes a ramp of width p,
// p^2 / 12, whose place against the edge is as good as random, p^2 / 12), by the pixel (its 3 x 3
// points: 8/9 of (a^2 + b^2) / 12) and by the area-weighted resampling ((a^2 + b^2) / 12). Over a
// texel's edge leaks half the mean |x| of the sum, sigma / sqrt(2 pi) for a bell: that share of a
// texel, from each neighbour. Mean over the lattice and both axes, for the filter on the axis.
double PredictedLeak(const IdealRig& rig) {
  const auto lattice = rig.Geometry().lattice;
  const int width = rig.sensor_width * rig.resolution, height = rig.sensor_height * rig.resolution;
  std::array<lightfield::Vec2, 4> corners = *rig.corners;
  for (auto& c : corners)
    c = {0.5 * rig.sensor_width * IdealRig::kPixel_m * c.x,
         0.5 * rig.sensor_height * IdealRig::kPixel_m * c.y};
  const auto d = corners[2] - corners[0], e = corners[3] - corners[1];
  const double mean_pixel_square = 0.5 * std::abs(d.x * e.y - d.y * e.x) / (width * height);
  const auto homography = rig::Homography::FromCorners(width, height, corners);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const lightfield::Vec2 pixel{double(x), double(y)};
      const auto q = homography.Map(pixel);
      if (std::abs(q.x) > 0.5 * lattice.extent_s_m() || std::abs(q.y) > 0.5 * lattice.extent_t_m())
        continue;
      const auto a = homography.Map(pixel + lightfield::Vec2{1, 0}) - q;
      const auto b = homography.Map(pixel + lightfield::Vec2{0, 1}) - q;
      for (const double edges : {a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y}) {
        const double variance = mean_pixel_square / 6 + edges / 12 * (8.0 / 9 + 1);
        sum += std::sqrt(variance / (2 * std::numbers::pi)) / lattice.ds_m;
        ++count;
      }
    }
  return sum / count;
}

TEST_F(IdealChain, ReflectorErrsByAPixelsBlurAndConverges) {
  std::vector<double> errors;
  for (const int resolution : {2, 4}) {
    IdealRig rig;
    rig.name = "reflector";
    rig.corners = {{{-1.08, 1.1}, {1.4, 1.2}, {1.2, -1.1}, {-1.1, -1.5}}};
    rig.resolution = resolution;
    const auto figure = [&](const char* name) {
      return fmt::format("{}_at_{}_by_{}_pixels", name, rig.sensor_width * resolution,
                         rig.sensor_height * resolution);
    };
    const LightField lamp = StructuredLamp(rig, kSeed);
    const IdealRun run = Run(rig, lamp);
    const auto& lattice = lamp.geometry.lattice;
    double product = 0, square = 0, error_square = 0;
    for (int m = 0; m < lamp.geometry.grid.count(); ++m)
      for (int row = 0; row < lattice.height; ++row)
        for (int column = 0; column < lattice.width; ++column) {
          const double truth = At(run.true_irradiance[m], lattice, row, column);
          const double error =
              At(run.chain.measurements.positions[m].irradiance, lattice, row, column) - truth;
          const double second = SecondDifferences(run.true_irradiance[m], lattice, row, column);
          product += error * second;
          square += second * second;
          error_square += error * error;
        }
    const double leak = product / square, predicted = PredictedLeak(rig),
                 explained = product / std::sqrt(square * error_square);
    Report(figure("reflector_leak"), leak);
    Report(figure("reflector_leak_predicted"), predicted);
    Report(figure("reflector_error_explained"), explained);
    // To first order in the leak: what crosses edges of both axes is left out.
    EXPECT_NEAR(leak / predicted, 1, predicted + 0.05);
    EXPECT_GT(explained, 0.8);
    const double
        irradiance_error =
            planning::IrradianceError(run.chain.measurements, run.true_irradiance).rel_rmse,
        error = planning::CompareWithTruth(run.chain.reconstruction.coefficients.data, lamp.data)
                    .rel_l2;
    Report(figure("reflector_E_error"), irradiance_error);
    Report(figure("reflector_C_error"), error);
    errors.push_back(irradiance_error);
  }
  EXPECT_NEAR(errors[1] / errors[0], 0.5, 0.1);
}

double MeanSquareOverTexels(const LightField& values, const LightField* truth,
                            const std::vector<std::uint16_t>& unknown, bool complete) {
  double sum = 0;
  std::size_t count = 0;
  const auto& geometry = values.geometry;
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (std::size_t k = 0; k < geometry.plane_size(); ++k) {
      if ((unknown[k] == 0) != complete) continue;
      const double d = values.image(m, 0)[k] - (truth ? truth->image(m, 0)[k] : 0.0f);
      sum += d * d;
      ++count;
    }
  return sum / static_cast<double>(count);
}

double MeanOverTexels(const LightField& values, const std::vector<std::uint16_t>& unknown,
                      bool complete) {
  double sum = 0;
  std::size_t count = 0;
  for (int m = 0; m < values.geometry.grid.count(); ++m)
    for (std::size_t k = 0; k < values.geometry.plane_size(); ++k)
      if ((unknown[k] == 0) == complete) {
        sum += values.image(m, 0)[k];
        ++count;
      }
  return sum / static_cast<double>(count);
}

// A sensor that misses the outer texels at the outer positions.
TEST_F(IdealChain, OffTheSensorIsUnknownNotZero) {
  IdealRig rig;
  rig.name = "small_sensor";
  rig.sensor_width = 64;
  rig.sensor_height = 60;
  const std::pair<std::string, LightField> lamps[] = {{"structured", StructuredLamp(rig, kSeed)},
                                                      {"flat", FlatLamp(rig, 1e6, kSeed)}};
  for (const auto& [kind, lamp] : lamps) {
    const IdealRun run = Run(rig, lamp);
    const auto& geometry = lamp.geometry;
    const auto& lattice = geometry.lattice;
    const auto& coefficients = run.chain.reconstruction.coefficients;
    const auto& unknown = run.chain.reconstruction.unknown_positions;

    // Flags: exactly the texels that reach over the sensor's edge about the filter's centre.
    const double half_s = 0.5 * rig.sensor_width * IdealRig::kPixel_m,
                 half_t = 0.5 * rig.sensor_height * IdealRig::kPixel_m, tiny = 1e-9;
    std::vector<std::uint16_t> expected(geometry.plane_size(), 0);
    for (int m = 0; m < geometry.grid.count(); ++m) {
      const auto c = geometry.grid.centre(m % rig.grid_width, m / rig.grid_width);
      for (int row = 0; row < lattice.height; ++row)
        for (int column = 0; column < lattice.width; ++column) {
          const auto s = lattice.centre(row, column) - c;
          const bool off = std::abs(s.x) + 0.5 * lattice.ds_m > half_s + tiny ||
                           std::abs(s.y) + 0.5 * lattice.dt_m > half_t + tiny;
          const auto k = static_cast<std::size_t>(row) * lattice.width + column;
          expected[k] += off;
          const auto& position = run.chain.measurements.positions[m];
          ASSERT_EQ(position.mask[k] & lightfield::kUnknownMask, off ? lightfield::kOffSensor : 0u)
              << m << " " << row << " " << column;
        }
    }
    EXPECT_EQ(unknown, expected);

    // The wrong way: the same irradiances, off the sensor believed to be dark.
    Measurements believed_dark = run.chain.measurements;
    for (auto& position : believed_dark.positions)
      std::fill(position.mask.begin(), position.mask.end(), 0u);
    const LightField wrong = reconstruct::Reconstruct(believed_dark).coefficients;

    const auto rmse = [&](const LightField& values, bool complete) {
      return std::sqrt(MeanSquareOverTexels(values, &lamp, unknown, complete)) /
             MeanOverTexels(lamp, unknown, complete);
    };
    Report(kind + "_complete_texels_rmse", rmse(coefficients, true));
    Report(kind + "_incomplete_texels_rmse", rmse(coefficients, false));
    Report(kind + "_incomplete_texels_rmse_taken_as_zero", rmse(wrong, false));
    EXPECT_LT(rmse(coefficients, true), 1e-4);
    EXPECT_LT(rmse(coefficients, false), 0.7 * rmse(wrong, false));

    // The smallest of all solutions that fit is not larger than the truth, which fits.
    EXPECT_LE(MeanSquareOverTexels(coefficients, nullptr, unknown, false),
              MeanSquareOverTexels(lamp, nullptr, unknown, false) * (1 + 1e-4));
  }
}

}  // namespace
}  // namespace luxfield::physics
