#include "luxfield/reconstruct/solve/ray_lines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

double NarrowestZOf(const std::vector<RayLine>& lines) {
  NarrowestZ waist;
  for (const RayLine& line : lines) waist.Add(line);
  return waist.z();
}

// Four steep pencils through the axis at z = 1 and four grazing ones through it at z = 0: with
// weights w = flux cos^4 the variance sum w |m|^2 (z - z_k)^2 is least at the weighted mean of z_k.
TEST(NarrowestZ, WeighsByTheFourthPowerOfTheCosine) {
  constexpr double kSteep = 0.5, kGrazing = 3, kFlux = 2;
  std::vector<RayLine> lines;
  for (const Vec2 way : {Vec2{1, 0}, Vec2{-1, 0}, Vec2{0, 1}, Vec2{0, -1}}) {
    lines.push_back({-kSteep * way, kSteep * way, kFlux, 1 / std::sqrt(1 + kSteep * kSteep)});
    lines.push_back({{}, kGrazing * way, 1, 1 / std::sqrt(1 + kGrazing * kGrazing)});
  }
  const double steep = kFlux * kSteep * kSteep / std::pow(1 + kSteep * kSteep, 2),
               grazing = kGrazing * kGrazing / std::pow(1 + kGrazing * kGrazing, 2);
  EXPECT_NEAR(NarrowestZOf(lines), steep / (steep + grazing), 1e-12);
}

// A pencil that leans is narrowest where its rays meet, whichever way it leans.
TEST(NarrowestZ, IsWhereALeaningPencilMeets) {
  const Vec2 point{0.1, -0.2};
  constexpr double kZ = 0.7;
  std::vector<RayLine> lines;
  for (const Vec2 way : {Vec2{0.5, 0.1}, Vec2{0.7, -0.1}, Vec2{0.6, 0.3}})
    lines.push_back({point - kZ * way, way, 1, 1 / std::sqrt(1 + way.x * way.x + way.y * way.y)});
  EXPECT_NEAR(NarrowestZOf(lines), kZ, 1e-12);
}

}  // namespace
}  // namespace luxfield::reconstruct
