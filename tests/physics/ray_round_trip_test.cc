// Light fields to rays, through every format of ray files, and back by least squares: what comes
// back is the light field within the counting noise of the rays, and nothing of it is turned.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "luxfield/formats/ray_formats.h"
#include "luxfield/preprocess/ray_sampler.h"
#include "luxfield/reconstruct/solve/import_rays.h"
#include "tests/formats/light_field_lamps.h"
#include "tests/lightfield/support.h"
#include "tests/seed.h"

namespace luxfield {
namespace {

using formats::RayFormat;
using lightfield::LightField;
using lightfield::LuminaireGeometry;

constexpr std::uint64_t kRays = 100000;
constexpr int kBlockColumns = 8, kBlockRows = 8;  // texels of a block

// The same functions within a grid whose inner cells hold all their supports.
LuminaireGeometry Padded(LuminaireGeometry g) {
  const int around = g.grid.basis.cells - 1;
  g.grid.u0_m -= around * g.grid.spacing_m;
  g.grid.v0_m -= around * g.grid.spacing_m;
  g.grid.width += 2 * around;
  g.grid.height += 2 * around;
  return g;
}

reconstruct::RayImport ThroughFile(const std::vector<lightfield::PosedLightField>& lamp,
                                   RayFormat format, const char* ending, std::uint64_t seed) {
  const preprocess::RaySampler sampler(lamp, "lamp");
  core::Random random(seed, static_cast<std::uint64_t>(format));
  formats::RayFileHeader header;
  header.ray_count = kRays;
  header.luminous_flux_lm = sampler.flux();
  const auto path = lightfield::UniquePath(ending);
  std::uint64_t written = 0;
  formats::WriteRays(path, format, header, true, false, [&](formats::Ray& ray) {
    if (written == kRays) return false;
    const auto drawn = sampler.Draw(random);
    ray = {drawn.position_m, drawn.direction, sampler.flux() / kRays, {}};
    ++written;
    return true;
  });
  reconstruct::ImportRaysOptions options;
  options.geometry = Padded(lamp.front().field.geometry);
  options.signs = reconstruct::RaySigns::kSigned;
  auto result = reconstruct::ImportRays(formats::ReadRays(path), options);
  std::filesystem::remove(path);
  return result;
}

// Flux of a block of texels and its moments over F, all about `middle`: sums of C times integrals
// of Phi, (u - u0) Phi and, of the B-spline, whose variance is h^2 / 4, (u - u0)^2 Phi.
struct Moments {
  double flux = 0, u = 0, v = 0, uu = 0, vv = 0;
};

Moments OfBlock(const LightField& field, int block_row, int block_column, lightfield::Vec2 middle) {
  const auto& g = field.geometry;
  const double unit = g.lattice.texel_area_m2() * g.grid.PhiIntegral(),
               spread = g.grid.spacing_m * g.grid.spacing_m / 4;
  Moments sum;
  for (int m = 0; m < g.grid.count(); ++m) {
    double flux = 0;
    for (int row = 0; row < kBlockRows; ++row)
      for (int column = 0; column < kBlockColumns; ++column)
        flux +=
            unit * field.image(m, 0)[std::size_t(block_row * kBlockRows + row) * g.lattice.width +
                                     block_column * kBlockColumns + column];
    const auto at = g.grid.centre(m % g.grid.width, m / g.grid.width) - middle;
    sum.flux += flux;
    sum.u += flux * at.x;
    sum.v += flux * at.y;
    sum.uu += flux * (at.x * at.x + spread);
    sum.vv += flux * (at.y * at.y + spread);
  }
  return sum;
}

// Of n rays of flux f each in a block, the flux has the variance n f^2, the first moments about
// their true middle n f^2 times the variance of u; blocks have independent ones but for the number
// of all rays, which is given.
void ExpectCountingNoise(const LightField& truth, const LightField& found, double ray_flux) {
  const auto& lattice = truth.geometry.lattice;
  double squares = 0, degrees = -1;
  for (int row = 0; row < lattice.height / kBlockRows; ++row)
    for (int column = 0; column < lattice.width / kBlockColumns; ++column) {
      const Moments about_zero = OfBlock(truth, row, column, {});
      if (about_zero.flux < 100 * ray_flux) continue;
      const lightfield::Vec2 middle{about_zero.u / about_zero.flux, about_zero.v / about_zero.flux};
      const Moments exact = OfBlock(truth, row, column, middle),
                    noisy = OfBlock(found, row, column, middle);
      squares += std::pow(noisy.flux - exact.flux, 2) / (ray_flux * exact.flux) +
                 noisy.u * noisy.u / (ray_flux * exact.uu) +
                 noisy.v * noisy.v / (ray_flux * exact.vv);
      degrees += 3;
    }
  EXPECT_GT(degrees, 30);
  EXPECT_LT(std::abs(squares - degrees), 5 * std::sqrt(2 * degrees)) << squares << " " << degrees;
}

TEST(RayRoundTrip, GivesTheLightFieldBackWithinCountingNoise) {
  const auto seed = TestSeed(130);
  const auto lamp = formats::AsymmetricLamp();
  const double flux = lightfield::TotalFlux(lamp)[0];
  const auto padded = [&](const LightField& field) {
    LightField wider(Padded(field.geometry));
    for (int j = 0; j < field.geometry.grid.height; ++j)
      for (int i = 0; i < field.geometry.grid.width; ++i) {
        const auto from = field.image(field.geometry.grid.index(i, j), 0);
        std::copy(from.begin(), from.end(),
                  wider.image(wider.geometry.grid.index(i + 2, j + 2), 0).begin());
      }
    return wider;
  };
  const LightField truth = padded(lamp.front().field);
  for (const auto& [format, ending] :
       {std::pair{RayFormat::kTm25, ".tm25ray"}, std::pair{RayFormat::kZemax, ".dat"},
        std::pair{RayFormat::kLightTools, ".ltrf"}, std::pair{RayFormat::kLightToolsText, ".txt"},
        std::pair{RayFormat::kSpeos, ".ray"}}) {
    SCOPED_TRACE(ending);
    const auto back = ThroughFile(lamp, format, ending, seed);
    EXPECT_EQ(back.report.used.rays, kRays);
    EXPECT_NEAR(lightfield::TotalFlux(back.coefficients)[0] / flux, 1, 1e-6);
    ExpectCountingNoise(truth, back.coefficients.front().field, flux / kRays);
  }
}

}  // namespace
}  // namespace luxfield
