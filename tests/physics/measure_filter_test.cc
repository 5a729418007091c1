// `filter measure` on photographs from the simulated bench, whose truth is known.
#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/planning/filter_photographs.h"
#include "luxfield/reconstruct/calibrate/filter/disc_centroids.h"
#include "luxfield/reconstruct/calibrate/filter/photograph.h"
#include "tests/core/chi_squared.h"

namespace luxfield::planning {
namespace {

using lightfield::Vec2;
using testing::HasSubstr;

constexpr int kPixels = 320;

hal::sim::LabDescription Lab(const std::string& errors, bool dual = false, std::uint64_t seed = 1) {
  const std::string text =
      "[lab]\ndriver = \"sim\"\n[rig]\nkind = \"lensless\"\ndelta_m = 0.3\n[filter]\n"
      "spacing_m = 0.02\n" +
      std::string(dual ? "kind = \"dual\"\nbasis = \"quadratic\"\n"
                       : "scale = 1.7777777777777777\n") +
      "[lamp]\nkind = \"square\"\nside_m = 0.06\nradiance = 1000\n"
      "[camera]\npitch_m = 0.01\nwidth = 32\nheight = 24\nbits = 14\nblack_dn = 400\n"
      "saturation_dn = 16000\ngain_dn_per_e = 0.16\nresponsivity_e_per_s_per_w_m2 = [1000]\n"
      "min_exposure_s = 1e-3\nmax_exposure_s = 10\n"
      "[stage]\nmin_m = [-0.1, -0.1]\nmax_m = [0.1, 0.1]\n[errors.photon_noise]\n"
      "[errors.read_noise]\nrms_dn = 1.6\n[errors.prnu]\nrms = 0.01\n"
      "[errors.vignetting]\ncorner_loss = 0.2\n" +
      errors;
  return hal::sim::ReadLab(core::Config::FromString(text, "lab.toml"), seed);
}

const std::string kPrintErrors =
    "[errors.registration]\nshift_m = [2e-4, -1.5e-4]\nrotation_deg = 0.3\n"
    "[errors.density]\nrelative = -0.02\ngamma = 0.05\n";

TEST(MeasureFilter, TransmittanceIsThePrintsWithinItsSigma) {
  for (const bool dual : {false, true}) {
    const hal::sim::FilterBench bench(Lab(kPrintErrors, dual), kPixels);
    const reconstruct::FilterPhotographs photographs = planning::PhotographFilter(bench);
    reconstruct::FilterReadings readings;
    const auto filter = reconstruct::MeasureFilter(photographs.sheet, photographs.light,
                                                   photographs.prints, &readings);
    ASSERT_EQ(filter.prints.size(), dual ? 2u : 1u);
    double difference = 0, sum = 0, square = 0, count = 0;
    for (std::size_t p = 0; p < filter.prints.size(); ++p)
      for (int row = 0; row < filter.lattice.height; ++row)
        for (int column = 0; column < filter.lattice.width; ++column) {
          double truth = 0;
          for (int k = 0; k < 16; ++k)
            truth += bench.print().SheetTransmittance(
                         {filter.lattice.s_of_column(column + (k % 4 + 0.5) / 4),
                          filter.lattice.t_of_row(row + (k / 4 + 0.5) / 4)},
                         static_cast<int>(p)) /
                     16;
          const std::size_t at = std::size_t(row) * filter.lattice.width + column;
          const double d = filter.prints[p].transmittance[at] - truth;
          difference += d;
          sum += truth;
          if (truth < 0.1) continue;  // where noise is above the curvature over a pixel
          const double z = d / filter.prints[p].sigma[at];
          square += z * z;
          ++count;
        }
    // All light together: the light's level is known to the noise of the holes, 0.01 %.
    EXPECT_NEAR(difference / sum, 0, 5e-4);
    // Texels share pixels, and the picture is a little smoother than the print: within 15 %. The
    // dual function has ridges that a pixel rounds off by more than the noise.
    if (!dual) {
      EXPECT_NEAR(std::sqrt(square / count), 1, 0.15);
    }
    const auto& reading = readings.prints[0];
    EXPECT_NEAR(reading.shift_m.x, 2e-4, 4 * reading.shift_sigma_m + 2e-6);
    EXPECT_NEAR(reading.shift_m.y, -1.5e-4, 4 * reading.shift_sigma_m + 2e-6);
    EXPECT_LT(reading.shift_sigma_m, 5e-6);
    EXPECT_NEAR(reading.rotation_rad, 0.3 * 3.14159265 / 180, 1e-4);
    EXPECT_LT(readings.holder_residual_m, 1e-5);
  }
}

// Shift over 6 benches against its own sigma.
TEST(MeasureFilter, ShiftIsWithinItsStandardDeviation) {
  double square = 0;
  constexpr int kBenches = 6;
  for (int k = 0; k < kBenches; ++k) {
    const reconstruct::FilterPhotographs photographs = planning::PhotographFilter(
        hal::sim::FilterBench(Lab(kPrintErrors, false, 100 + k), kPixels));
    const auto filter =
        reconstruct::MeasureFilter(photographs.sheet, photographs.light, photographs.prints);
    const Vec2 off = filter.shift_m - Vec2{2e-4, -1.5e-4};
    square += (off.x * off.x + off.y * off.y) / (filter.shift_sigma_m * filter.shift_sigma_m);
  }
  // Chi-squared of as many degrees as there are shifts. The bench's picture is a mean over 4 x 4
  // points, whose discs are ragged by a few per cent of a pixel: allow twice.
  constexpr int kDegrees = 2 * kBenches;
  std::printf("shifts: chi^2 per degree %.3f of %d\n", square / kDegrees, kDegrees);
  EXPECT_GT(square / kDegrees, ChiSquaredShare(kDegrees, -kRareZ));
  EXPECT_LT(square / kDegrees, 2 * ChiSquaredShare(kDegrees, kRareZ));
}

TEST(MeasureFilter, WedgeTellsThePrintersTone) {
  const reconstruct::FilterPhotographs photographs =
      planning::PhotographFilter(hal::sim::FilterBench(Lab(kPrintErrors), kPixels));
  reconstruct::FilterReadings readings;
  reconstruct::MeasureFilter(photographs.sheet, photographs.light, photographs.prints, &readings);
  const auto& wedge = readings.prints[0].wedge;
  ASSERT_GE(wedge.size(), 15u);
  for (std::size_t k = 0; k < wedge.size(); ++k)
    EXPECT_NEAR(wedge[k].density, 1.05 * 0.15 * static_cast<double>(k) - std::log10(0.98),
                5 * wedge[k].sigma + 2e-4)
        << k;
  // A sheet printed by that table would have the transmittance meant, relative to clear film.
  const rig::ToneTable tone = readings.Tone();
  for (const double t : {0.9, 0.3, 0.05, 0.004})
    EXPECT_NEAR(std::pow(tone.Code(t), 1.05) / t, 1, 0.005) << t;
}

// Light's drift between the photographs cancels through the holder's holes.
TEST(MeasureFilter, TheLightsLevelDoesNotMatter) {
  reconstruct::FilterPhotographs photographs =
      planning::PhotographFilter(hal::sim::FilterBench(Lab(""), kPixels));
  const auto before =
      reconstruct::MeasureFilter(photographs.sheet, photographs.light, photographs.prints);
  for (float& x : photographs.prints[0].rate_e_per_s) x *= 1.1f;
  for (float& x : photographs.prints[0].sigma_e_per_s) x *= 1.1f;
  reconstruct::FilterReadings readings;
  const auto after = reconstruct::MeasureFilter(photographs.sheet, photographs.light,
                                                photographs.prints, &readings);
  EXPECT_NEAR(readings.prints[0].light_ratio, 1.1, 0.02);
  for (std::size_t k = 0; k < after.prints[0].transmittance.size(); ++k)
    EXPECT_NEAR(after.prints[0].transmittance[k], before.prints[0].transmittance[k], 2e-6);
}

void Mirror(reconstruct::MergedFrame& photograph) {
  const auto width = static_cast<std::size_t>(photograph.width);
  for (std::size_t row = 0; row < static_cast<std::size_t>(photograph.height); ++row) {
    std::reverse(photograph.rate_e_per_s.begin() + static_cast<std::ptrdiff_t>(row * width),
                 photograph.rate_e_per_s.begin() + static_cast<std::ptrdiff_t>((row + 1) * width));
  }
}

TEST(MeasureFilter, RefusesByName) {
  const reconstruct::FilterPhotographs good =
      planning::PhotographFilter(hal::sim::FilterBench(Lab(""), kPixels));
  const auto refusal = [&](auto change) {
    reconstruct::FilterPhotographs p = good;
    change(p);
    try {
      reconstruct::MeasureFilter(p.sheet, p.light, p.prints);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_THAT(refusal([](auto& p) {
                Mirror(p.light);
                Mirror(p.prints[0]);
              }),
              HasSubstr("no registration mark near (-28.8, 34.8)"));
  EXPECT_THAT(refusal([](auto& p) { p.sheet.holder_marks[2].centre_m.x = 0.06; }),
              HasSubstr("the holes of the holder lie"));
  EXPECT_THAT(refusal([](auto& p) { p.prints.clear(); }), HasSubstr("0 of prints"));
  EXPECT_THAT(refusal([](auto& p) {
                std::fill(p.light.rate_e_per_s.begin(), p.light.rate_e_per_s.end(), 0.0f);
              }),
              HasSubstr("no bright window"));
  EXPECT_THAT(refusal([](auto& p) {
                p.prints[0].mask[kPixels * kPixels / 2 + kPixels / 2] = lightfield::kSaturated;
              }),
              HasSubstr("flags 2"));
  EXPECT_THAT(refusal([](auto& p) {
                for (int k = 0; k < kPixels * kPixels; ++k)
                  if (k % kPixels < kPixels / 6) p.light.rate_e_per_s[k] = 0;
              }),
              HasSubstr("no hole of the holder near (-48, 48)"));
}

TEST(MeasureFilter, RefusesPairsInTheWrongOrderOrTwiceTheSame) {
  const reconstruct::FilterPhotographs good =
      planning::PhotographFilter(hal::sim::FilterBench(Lab("", true), kPixels));
  const auto refusal = [&](std::size_t first, std::size_t second) {
    const std::vector<reconstruct::MergedFrame> prints{good.prints[first], good.prints[second]};
    try {
      reconstruct::MeasureFilter(good.sheet, good.light, prints);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(0, 1), "");
  EXPECT_THAT(refusal(1, 0), HasSubstr("print 1 of the pair looks like its minus part"));
  EXPECT_THAT(refusal(0, 0), HasSubstr("print 2 of the pair looks like its plus part"));
  EXPECT_THAT(refusal(1, 1), HasSubstr("print 1 of the pair looks like its minus part"));
  try {
    reconstruct::MeasureFilter(good.sheet, good.light, std::span(good.prints).first(1));
    ADD_FAILURE() << "half a pair was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("1 of prints, the sheet has 2"));
  }
}

TEST(MeasureFilter, PhotographsKeepTheirValuesOnDisk) {
  const reconstruct::FilterPhotographs p =
      planning::PhotographFilter(hal::sim::FilterBench(Lab(""), 64));
  const auto file = std::filesystem::path(testing::TempDir()) / "photograph.exr";
  reconstruct::WritePhotograph(file, p.light);
  const auto back = reconstruct::ReadPhotograph(file);
  EXPECT_EQ(back.width, p.light.width);
  EXPECT_EQ(back.height, p.light.height);
  EXPECT_EQ(back.rate_e_per_s, p.light.rate_e_per_s);
  EXPECT_EQ(back.sigma_e_per_s, p.light.sigma_e_per_s);
  EXPECT_EQ(back.mask, p.light.mask);
}

// A homography through random points, and its least-squares behaviour.
TEST(DiscCentroids, HomographyIsFoundFromItsPoints) {
  const rig::Homography h({1e-4, 2e-6, -0.02, 1e-6, -1.1e-4, 0.03, 1e-5, -2e-5, 1});
  std::vector<Vec2> sensor, plane;
  for (const double x : {10.0, 150.0, 300.0})
    for (const double y : {20.0, 160.0, 290.0}) {
      sensor.push_back({x, y});
      plane.push_back(h.Map({x, y}));
    }
  const auto fit = reconstruct::FitHomography(sensor, plane);
  for (const Vec2 p : {Vec2{0, 0}, Vec2{310, 12}, Vec2{77, 300}}) {
    const Vec2 a = h.Map(p), b = fit.Map(p);
    EXPECT_NEAR(a.x, b.x, 1e-12);
    EXPECT_NEAR(a.y, b.y, 1e-12);
  }
  EXPECT_THROW(reconstruct::FitHomography(std::span(sensor).first(3), std::span(plane).first(3)),
               InputError);
  const std::vector<Vec2> line{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  EXPECT_THROW(reconstruct::FitHomography(line, line), InputError);
}

}  // namespace
}  // namespace luxfield::planning
