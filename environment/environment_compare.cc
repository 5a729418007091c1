#include "luxfield/environment/environment_compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"

namespace luxfield::environment {
namespace {

// w -> (sign_0 w[order_0], sign_1 w[order_1], sign_2 w[order_2]).
struct Symmetry {
  std::array<int, 3> order;
  std::array<double, 3> sign;

  lightfield::Vec3 operator()(lightfield::Vec3 w) const {
    const std::array<double, 3> c = {w.x, w.y, w.z};
    return {sign[0] * c[order[0]], sign[1] * c[order[1]], sign[2] * c[order[2]]};
  }
};

// All 48; the identity first.
std::vector<Symmetry> CubeSymmetries() {
  std::vector<Symmetry> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs)
      all.push_back(
          {order, {signs & 1 ? -1.0 : 1.0, signs & 2 ? -1.0 : 1.0, signs & 4 ? -1.0 : 1.0}});
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

double Relative(const CubeMap& a, const CubeMap& b, const std::vector<double>& angles,
                const Symmetry& b_to_a) {
  const int n = a.face_size;
  double difference = 0, sum = 0;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < n; ++row)
      for (int column = 0; column < n; ++column) {
        const lightfield::Vec3 w =
            CubeVector({face, -1 + (2 * column + 1.0) / n, 1 - (2 * row + 1.0) / n});
        const std::size_t here = 3 * b.texel(face, row, column), there = 3 * a.texel_of(b_to_a(w));
        const double angle = angles[static_cast<std::size_t>(row) * n + column];
        for (std::size_t c = 0; c < 3; ++c) {
          difference += angle * std::abs(double{a.data[there + c]} - b.data[here + c]);
          sum += angle * b.data[here + c];
        }
      }
  return difference / sum;
}

double IrradianceDifference(const CubeMap& a, const CubeMap& b) {
  constexpr int kOrientations = 24;  // on a spiral
  double worst = 0;
  for (int k = 0; k < kOrientations; ++k) {
    const double z = 1 - (2 * k + 1.0) / kOrientations, r = std::sqrt(1 - z * z),
                 phi = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const lightfield::Vec3 n = {r * std::cos(phi), r * std::sin(phi), z};
    worst = std::max(
        worst, std::abs(core::Luminance(Irradiance(a, n)) - core::Luminance(Irradiance(b, n))));
  }
  // The mean of E over orientations is pi times that of L.
  return worst / (std::numbers::pi * core::Luminance(MeanRadiance(b)));
}

}  // namespace

EnvironmentDifference CompareEnvironments(const CubeMap& a, const CubeMap& b) {
  if (a.face_size != b.face_size)
    throw InputError("environment maps of different face sizes; resample them to one");
  const core::Rgb mean_a = MeanRadiance(a), mean_b = MeanRadiance(b);
  if (!(core::Luminance(mean_b) > 0))
    throw InputError("the environment map to compare with is black");
  EnvironmentDifference result;
  for (std::size_t c = 0; c < 3; ++c)
    if (mean_b[c] > 0)
      result.mean = std::max(result.mean, std::abs(mean_a[c] - mean_b[c]) / mean_b[c]);
  result.irradiance = IrradianceDifference(a, b);
  const std::vector<double> angles = TexelSolidAngles(a.face_size);
  const std::vector<Symmetry> symmetries = CubeSymmetries();
  result.relative = Relative(a, b, angles, symmetries.front());
  for (std::size_t k = 1; k < symmetries.size(); ++k) {
    if (Relative(b, b, angles, symmetries[k]) <= 2 * result.relative) continue;
    const double turned = Relative(a, b, angles, symmetries[k]);
    result.turned = std::min(turned, result.turned.value_or(turned));
  }
  return result;
}

}  // namespace luxfield::environment
