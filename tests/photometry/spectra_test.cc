// Spectra and what follows from them, against closed forms and published values.
#include "luxfield/photometry/spectra.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include "luxfield/core/error.h"

namespace luxfield::photometry {
namespace {

// CIE 018:2019: the integral of V is 106.857 nm by sums over 5 nm; the luminous efficacy of
// illuminant A over 380 to 780 nm follows from its table.
TEST(Spectra, TablesAreThoseOfTheCie) {
  const Spectrum& v = LuminousEfficiency();
  double sum = 0;
  for (const double value : v.value) sum += 5 * value;
  EXPECT_NEAR(sum, 106.857, 2e-3);
  EXPECT_EQ(v.nm.back(), 780);
  const Spectrum& a = IlluminantA();
  // ISO/CIE 11664-2:2022, table 1.
  EXPECT_NEAR(a.value[80], 9.79510, 1e-4);   // 380 nm
  EXPECT_NEAR(a.value[260], 100, 1e-9);      // 560 nm
  EXPECT_NEAR(a.value[480], 241.675, 1e-2);  // 780 nm
}

// Triangles: the integral of a product of two that overlap by half.
TEST(Spectra, ProductsOfLinesAreExact) {
  const Spectrum a{{400, 500, 600}, {0, 1, 0}}, b{{500, 600, 700}, {0, 1, 0}};
  // integral of (1 - x) x over 100 nm.
  EXPECT_NEAR(IntegralOf(a, b), 100.0 / 6, 1e-12);
  EXPECT_NEAR(IntegralOf(a, a), 2 * 100.0 / 3, 1e-12);
}

// Two lines of light, where a camera sees half and twice what an eye does: F is the ratio of what it
// makes of either.
TEST(Spectra, TheFactorIsTheRatioOfErrors) {
  const Spectrum& v = LuminousEfficiency();
  Spectrum camera = v;
  for (std::size_t k = 0; k < v.nm.size(); ++k)
    camera.value[k] *= v.nm[k] < 550 ? 0.5 : v.nm[k] > 560 ? 2 : 1;
  const Spectrum blue{{449, 450, 451}, {0, 1, 0}}, red{{649, 650, 651}, {0, 1, 0}};
  EXPECT_NEAR(SpectralMismatchFactor(camera, blue, red), 4, 1e-9);
  EXPECT_NEAR(SpectralMismatchFactor(camera, red, blue), 0.25, 1e-9);
  EXPECT_NEAR(SpectralMismatchFactor(camera, red, red), 1, 1e-12);
  // Whatever its scale, an eye's own curve has no mismatch.
  for (double& value : camera.value) value = 0;
  for (std::size_t k = 0; k < v.nm.size(); ++k) camera.value[k] = 7 * v.value[k];
  EXPECT_NEAR(SpectralMismatchFactor(camera, blue, IlluminantA()), 1, 1e-12);
  EXPECT_NEAR(SpectralMismatchIndex(camera), 0, 1e-12);
}

// V moved into the infrared: nothing in common, so that f1' is the sum of both integrals over V's.
TEST(Spectra, TheIndexIsTheAreaBetweenTheCurves) {
  const Spectrum &v = LuminousEfficiency(), &a = IlluminantA();
  const Spectrum box{{800, 801, 899, 900}, {0, 1, 1, 0}};
  const double scale = IntegralOf(a, v) / IntegralOf(a, box);
  EXPECT_NEAR(SpectralMismatchIndex(box), 1 + 99 * scale / 106.857, 1e-4);
  EXPECT_THROW(SpectralMismatchIndex({{2000, 2100}, {1, 1}}), std::invalid_argument);
}

TEST(Spectra, FilesAreReadAndRefusedByLine) {
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield-spectrum.csv";
  const auto write = [&](const char* text) {
    std::ofstream(file) << text;
    return file;
  };
  const Spectrum read = ReadSpectrum(write("nm,value\n# a comment\n380, 0.5\n\n400\t1e-2\r\n"));
  EXPECT_EQ(read.nm, (std::vector<double>{380, 400}));
  EXPECT_EQ(read.value, (std::vector<double>{0.5, 0.01}));
  for (const char* wrong : {"", "380,1\n", "380,1\n380,2\n", "400,1\n390,1\n", "380,1\nx,2\n",
                            "380,1\n390,nan\n", "380,1\n390,1,5\n", "-5,1\n3,1\n"})
    EXPECT_THROW(ReadSpectrum(write(wrong)), InputError) << wrong;
  std::filesystem::remove(file);
  EXPECT_THROW(ReadSpectrum(file), InputError);
}

}  // namespace
}  // namespace luxfield::photometry
