// The draw of `precomputed` as the device runs it: chi-squared against the image it is drawn from.
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/preprocess/tables.h"
#include "luxfield/render/estimators/estimator.h"
#include "tests/render/chi_squared.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 20140606;

const char* const kKernel = R"(
#include "luxfield/render/kernels/luminaire/precomputed.cl"

__kernel void Draw(__global const ulong* sat, int m, int width, int height, uint seed,
                   __global int2* texel, __global float2* fraction) {
  const int k = get_global_id(0);
  const size_t size = (size_t)SatStride(width) * (height + 1);
  const WholeImage whole = MakeWholeImage(sat + m * size, width, height);
  const uint4 bits = Philox((uint4)((uint)k, 0u, 0u, 0u), (uint2)(seed, 0u));
  Place column, row;
  DrawPlace(&whole, (float2)(UnitFloat(bits.x), UnitFloat(bits.y)), &column, &row);
  texel[k] = (int2)(column.texel, row.texel);
  fraction[k] = (float2)(column.fraction, row.fraction);
}
)";

TEST(PrecomputedSampling, ChiSquaredAgainstTheImage) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const Program program =
      Program::BuildText(device, kKernel, "precomputed_sampling_test.cl", "-D GLOSSY=0");
  constexpr int kCount = 200000;
  for (const char* kind : {"rings", "facets", "filament", "noise"})
    for (const auto& [width, height] : {std::pair(40, 30), std::pair(2, 30), std::pair(5, 1)}) {
      LuminaireShape shape;
      shape.width = width;
      shape.height = height;
      const auto field = StructuredLuminaire(kind, shape, kSeed);
      const auto tables = preprocess::BuildTables(field, "test", std::string(64, '0'));
      constexpr int kImage = 4;
      const LuminaireOnDevice luminaire(device, field, {.sat = &tables});
      Buffer texel(device, kCount * sizeof(cl_int2)), fraction(device, kCount * sizeof(cl_float2));
      Kernel(program, "Draw")
          .Set(luminaire.sat(), cl_int{kImage}, cl_int{width}, cl_int{height},
               static_cast<cl_uint>(kSeed), texel, fraction)
          .Enqueue({kCount}, {64});
      const auto texels = texel.Download<cl_int2>();
      const auto fractions = fraction.Download<cl_float2>();
      // Bins: halves of texels, so that the place inside a texel is judged too.
      std::vector<double> expected(4 * width * height), observed(expected.size());
      for (int r = 0; r < 2 * height; ++r)
        for (int c = 0; c < 2 * width; ++c)
          expected[r * 2 * width + c] = field.image(kImage, 0)[r / 2 * width + c / 2];
      for (int k = 0; k < kCount; ++k) {
        const auto& t = texels[k].s;
        const auto& f = fractions[k].s;
        ASSERT_TRUE(t[0] >= 0 && t[0] < width && t[1] >= 0 && t[1] < height);
        ASSERT_TRUE(f[0] >= 0 && f[0] < 1 && f[1] >= 0 && f[1] < 1);
        ++observed[(2 * t[1] + (f[1] >= 0.5f)) * 2 * width + 2 * t[0] + (f[0] >= 0.5f)];
      }
      const std::string what =
          std::string(kind) + ", " + std::to_string(width) + " x " + std::to_string(height);
      EXPECT_LT(ChiSquaredDeviations(expected, observed, what), 5);
    }
}

}  // namespace
}  // namespace luxfield::render
