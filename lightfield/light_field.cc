#include "luxfield/lightfield/light_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/warning.h"
#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::lightfield {
namespace {

constexpr const char* kUnitNames[] = {"W", "lm", "relative"};

// Two digits name a basis function in a file, and no lattice of ours comes near the others.
constexpr int kMaxBasisPerAxis = 100;
constexpr int kMaxTexelsPerAxis = 1 << 15;
constexpr double kMaxValues = 0x1p33;  // 32 GiB of float
constexpr double kMaxLength_m = 1e6;

[[noreturn]] void Fail(const std::string& file, const std::string& problem) {
  throw InputError(file, problem, "correct the geometry it was made with");
}

void RequireLength(const std::string& file, const char* field, double value_m) {
  if (!(value_m > 0 && value_m <= kMaxLength_m))
    Fail(file,
         fmt::format("{} = {} must be above 0 and at most {} m", field, value_m, kMaxLength_m));
}

void RequireCoordinate(const std::string& file, const char* field, double value_m) {
  if (!(std::abs(value_m) <= kMaxLength_m))
    Fail(file, fmt::format("{} = {} must be within {} m", field, value_m, kMaxLength_m));
}

void RequireCount(const std::string& file, const char* field, int value, int max) {
  if (value < 1 || value > max)
    Fail(file, fmt::format("{} = {} must be between 1 and {}", field, value, max));
}

std::array<double, 3> Spread(std::array<double, 3> values, int channels) {
  if (channels == 1) values[1] = values[2] = values[0];
  return values;
}

std::array<double, 3> Scaled(double k, std::array<double, 3> values) {
  for (double& value : values) value *= k;
  return values;
}

// First and last basis function along one axis whose support holds x (in units of h from u0).
std::pair<int, int> ActiveRange(double x, int cells, int count) {
  if (!(x >= 0 && x < count + cells - 1)) return {0, -1};
  const int cell = static_cast<int>(x);
  return {std::max(0, cell - cells + 1), std::min(count - 1, cell)};
}

}  // namespace

std::string FluxUnitName(FluxUnit unit) { return kUnitNames[static_cast<int>(unit)]; }

FluxUnit FluxUnitFromName(const std::string& name) {
  for (int unit = 0; unit < 3; ++unit)
    if (name == kUnitNames[unit]) return static_cast<FluxUnit>(unit);
  throw InputError(fmt::format("unknown unit of flux '{}'; use W, lm or relative", name));
}

void LuminaireGeometry::Validate(const std::string& file) const {
  RequireLength(file, "delta_m", delta_m);
  RequireCount(file, "basis width", grid.width, kMaxBasisPerAxis);
  RequireCount(file, "basis height", grid.height, kMaxBasisPerAxis);
  RequireLength(file, "spacing_m", grid.spacing_m);
  RequireCoordinate(file, "u0_m", grid.u0_m);
  RequireCoordinate(file, "v0_m", grid.v0_m);
  RequireCount(file, "image width", lattice.width, kMaxTexelsPerAxis);
  RequireCount(file, "image height", lattice.height, kMaxTexelsPerAxis);
  RequireLength(file, "ds_m", lattice.ds_m);
  RequireLength(file, "dt_m", lattice.dt_m);
  RequireCoordinate(file, "s0_m", lattice.s0_m);
  RequireCoordinate(file, "t1_m", lattice.t1_m);
  if (channels != 1 && channels != 3)
    Fail(file, fmt::format("channels = {} must be 1 or 3", channels));
  const double values = 1.0 * grid.width * grid.height * lattice.width * lattice.height * channels;
  if (values > kMaxValues)
    Fail(file, fmt::format("{} images of {} x {} x {} values are more than 2^33", grid.count(),
                           lattice.width, lattice.height, channels));
  // Twice what the largest lamps need: planes some metres apart, grids and images some metres wide.
  core::SuspectLength(file, "delta_m", delta_m, 10);
  core::SuspectLength(file, "spacing_m", grid.spacing_m, 1);
  core::SuspectLength(file, "u0_m", grid.u0_m, 10);
  core::SuspectLength(file, "v0_m", grid.v0_m, 10);
  core::SuspectLength(file, "ds_m", lattice.ds_m, 0.5);
  core::SuspectLength(file, "dt_m", lattice.dt_m, 0.5);
  core::SuspectLength(file, "s0_m", lattice.s0_m, 50);
  core::SuspectLength(file, "t1_m", lattice.t1_m, 50);
}

std::array<double, 3> FluxDensity(const LightField& field, Vec2 u, Vec2 s) {
  const LuminaireGeometry& g = field.geometry;
  const double column = std::floor(g.lattice.column_of_s(s.x));
  const double row = std::floor(g.lattice.row_of_t(s.y));
  std::array<double, 3> sum{};
  if (!(column >= 0 && column < g.lattice.width && row >= 0 && row < g.lattice.height)) return sum;
  const auto texel =
      static_cast<std::size_t>(row) * g.lattice.width + static_cast<std::size_t>(column);

  const double x = (u.x - g.grid.u0_m) / g.grid.spacing_m;
  const double y = (u.y - g.grid.v0_m) / g.grid.spacing_m;
  const auto [i_first, i_last] = ActiveRange(x, g.grid.basis.cells, g.grid.width);
  const auto [j_first, j_last] = ActiveRange(y, g.grid.basis.cells, g.grid.height);
  for (int j = j_first; j <= j_last; ++j)
    for (int i = i_first; i <= i_last; ++i) {
      const double phi = g.grid.basis.Value(x - i) * g.grid.basis.Value(y - j);
      for (int channel = 0; channel < g.channels; ++channel)
        sum[channel] += phi * field.image(g.grid.index(i, j), channel)[texel];
    }
  return Spread(sum, g.channels);
}

std::array<double, 3> Radiance(const LightField& field, Vec2 u, Vec2 s) {
  const std::array<double, 3> density = FluxDensity(field, u, s);
  if (density == std::array<double, 3>{}) return density;  // far outside 1 / cos^4 may overflow
  const double cosine = CosTheta(field.geometry.delta_m, u, s);
  const double d = field.geometry.delta_m / (cosine * cosine);
  return Scaled(d * d, density);
}

std::array<double, 3> TotalFlux(const LightField& field) {
  const LuminaireGeometry& g = field.geometry;
  std::array<double, 3> sum{};
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < g.channels; ++channel)
      for (const float value : field.image(m, channel)) sum[channel] += value;
  return Spread(Scaled(g.lattice.texel_area_m2() * g.grid.PhiIntegral(), sum), g.channels);
}

std::array<double, 3> FarFieldIntensity(const LightField& field, Vec3 direction) {
  const LuminaireGeometry& g = field.geometry;
  std::array<double, 3> sum{};
  if (!(direction.z > 0)) return sum;
  const double delta = g.delta_m;
  const Vec2 shift{delta * direction.x / direction.z, delta * direction.y / direction.z};
  const auto columns =
      ProjectAllTexels(g.grid.basis, g.grid.u0_m, g.grid.spacing_m, g.grid.width,
                       TexelAxis::Columns(g.lattice), PencilAxis::Parallel(shift.x));
  const auto rows = ProjectAllTexels(g.grid.basis, g.grid.v0_m, g.grid.spacing_m, g.grid.height,
                                     TexelAxis::Rows(g.lattice), PencilAxis::Parallel(shift.y));
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i)
      for (int channel = 0; channel < g.channels; ++channel) {
        const auto image = field.image(g.grid.index(i, j), channel);
        const ProjectedTexels& x = columns[i];
        const ProjectedTexels& y = rows[j];
        for (std::size_t r = 0; r < y.size(); ++r) {
          const std::size_t start = (y.first + r) * g.lattice.width + x.first;
          sum[channel] +=
              y.zeroth[r] * WeightedSums(image.subspan(start, x.size()), x.zeroth, x.moment).a;
        }
      }
  if (sum == std::array<double, 3>{}) return sum;  // near the horizon 1 / cos^3 may overflow
  const double cosine = CosTheta(delta, {0, 0}, shift);
  return Spread(Scaled(delta * delta / (cosine * cosine * cosine), sum), g.channels);
}

}  // namespace luxfield::lightfield
