#include "luxfield/preprocess/summed_area.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/simd.h"
#include "luxfield/preprocess/table_images.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;

// Sums stay below 2^62 plus half a quantum per texel.
constexpr int kTotalBits = 62;

// Texels that are done side by side.
constexpr std::size_t kLanes = 64;

LUXFIELD_SIMD_CLONES void Magnitudes(const float* c, std::size_t size, float* magnitude) {
  std::size_t k = 0;
  for (; k + kLanes <= size; k += kLanes) {
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) magnitude[k + l] = std::abs(c[k + l]);
  }
  for (; k < size; ++k) magnitude[k] = std::abs(c[k]);
}

[[noreturn]] void RefuseTexel(const lightfield::LuminaireGeometry& g, std::span<const float> planes,
                              const std::string& name, int m, std::size_t texel) {
  const int width = g.lattice.width;
  for (int channel = 0; channel < g.channels; ++channel) {
    const float c = planes[channel * g.plane_size() + texel];
    if (std::isfinite(c)) continue;
    throw InputError(
        name,
        fmt::format("image C.{:02d}.{:02d} is {} at row {}, column {}", m / g.grid.width,
                    m % g.grid.width, c, texel / width, texel % width),
        "repair it, or make the light field again with 'luxfield reconstruct'");
  }
  throw InputError(name, "a coefficient changed while it was read", "run again");
}

std::span<const float> PlanesOf(const LightField& field, int m) {
  const std::size_t size = field.geometry.plane_size() * field.geometry.channels;
  return std::span(field.data).subspan(size * static_cast<std::size_t>(m), size);
}

// `texel` of [channel][texel].
float Magnitude(std::span<const float> planes, std::size_t texels, std::size_t texel) {
  return static_cast<float>(
      core::Luminance({std::abs(planes[texel]), std::abs(planes[texels + texel]),
                       std::abs(planes[2 * texels + texel])}));
}

template <typename T>
LUXFIELD_INLINE double SumOfLanes(const T* values, std::size_t size) {
  double lanes[kLanes] = {};
  std::size_t k = 0;
  for (; k + kLanes <= size; k += kLanes) {
    LUXFIELD_INDEPENDENT
    for (std::size_t l = 0; l < kLanes; ++l) lanes[l] += values[k + l];
  }
  for (std::size_t l = 0; k < size; ++k, ++l) lanes[l] += values[k];
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

}  // namespace

LUXFIELD_SIMD_CLONES double Sum(const float* values, std::size_t size) {
  return SumOfLanes(values, size);
}
LUXFIELD_SIMD_CLONES double Sum(const double* values, std::size_t size) {
  return SumOfLanes(values, size);
}

float TexelMagnitude(const LightField& field, int m, std::size_t texel) {
  if (field.geometry.channels == 1) return std::abs(field.image(m, 0)[texel]);
  return Magnitude(PlanesOf(field, m), field.geometry.plane_size(), texel);
}

double MagnitudeSum(const LightField& field, const std::string& name, int m,
                    std::span<float> magnitude) {
  return MagnitudeSum(field.geometry, PlanesOf(field, m), name, m, magnitude);
}

double MagnitudeSum(const lightfield::LuminaireGeometry& geometry, std::span<const float> planes,
                    const std::string& name, int m, std::span<float> magnitude) {
  const std::size_t size = geometry.plane_size();
  if (geometry.channels == 1)
    Magnitudes(planes.data(), size, magnitude.data());
  else
    for (std::size_t k = 0; k < size; ++k) magnitude[k] = Magnitude(planes, size, k);
  const double sum = Sum(magnitude.data(), size);
  if (sum <= std::numeric_limits<float>::max()) return sum;
  for (std::size_t k = 0; k < size; ++k)
    for (int channel = 0; channel < geometry.channels; ++channel)
      if (!std::isfinite(planes[channel * size + k])) RefuseTexel(geometry, planes, name, m, k);
  throw InputError(name,
                   fmt::format("the sum of image C.{:02d}.{:02d} exceeds the range of float32",
                               m / geometry.grid.width, m % geometry.grid.width),
                   "scale the light field down");
}

int SummedAreaExponent(double sum) {
  if (!(sum > 0)) return 0;
  int binary_exponent = 0;
  std::frexp(sum, &binary_exponent);
  return kTotalBits - binary_exponent;
}

// One pass over the image, row prefix plus the row above.
template <typename T>
int BuildSummedArea(std::span<const T> values, double sum, int width, int height,
                    std::uint64_t* sat) {
  std::fill(sat, sat + width + 1, 0);
  const int exponent = SummedAreaExponent(sum);
  const double scale = std::ldexp(1.0, exponent);
  for (int r = 0; r < height; ++r) {
    const std::uint64_t* above = sat + static_cast<std::size_t>(r) * (width + 1);
    std::uint64_t* row = sat + static_cast<std::size_t>(r + 1) * (width + 1);
    const T* texel = values.data() + static_cast<std::size_t>(r) * width;
    std::uint64_t prefix = 0;
    row[0] = 0;
    for (int c = 0; c < width; ++c) {
      // Adding 0.5 is exact below 2^52 units; above, every value is a whole number already.
      const double units = static_cast<double>(texel[c]) * scale;
      const double half = units < 0x1p51 ? 0.5 : 0.0;
      prefix += static_cast<std::uint64_t>(static_cast<std::int64_t>(units + half));
      row[c + 1] = above[c + 1] + prefix;
    }
  }
  return exponent;
}

template int BuildSummedArea(std::span<const float>, double, int, int, std::uint64_t*);
template int BuildSummedArea(std::span<const double>, double, int, int, std::uint64_t*);

}  // namespace luxfield::preprocess
