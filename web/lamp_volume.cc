#include "luxfield/web/lamp_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/preprocess/cubic_spline.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::web {
namespace {

using lightfield::LightField;
using lightfield::LightVector;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Interval;

constexpr int kComponents = 3;       // of K
constexpr int kMomentStride = 4;     // of preprocess::TabulateMoments
constexpr double kKneeShare = 1e-2;  // of the largest |K_z|
constexpr double kLargestCode = 2047;

// ---- what holds light ----

bool AnyLight(std::span<const float> texels) {
  return std::any_of(texels.begin(), texels.end(), [](float c) { return c != 0; });
}

Rectangle Between(const Interval& x, const Interval& y) {
  return {{0.5 * (x.lo + x.hi), 0.5 * (y.lo + y.hi)}, {0.5 * (x.hi - x.lo), 0.5 * (y.hi - y.lo)}};
}

// ---- q ----

// One axis of q = (w p - m) / h for one w, or (p - m) / h between the planes.
struct Footprint {
  double middle = 0, half = 0;
};

Footprint FootprintOf(double middle_f, double half_f, double middle_i, double half_i, Side side,
                      double w) {
  if (side == Side::kFront)
    return {middle_i - (1 - w) * middle_f, half_i + std::abs(1 - w) * half_f};
  return {w * middle_i + (1 - w) * middle_f, w * half_i + (1 - w) * half_f};
}

struct Footprints {
  Footprint x, y;
};

Footprints FootprintsOf(const LightBounds& bounds, Side side, double w) {
  const Rectangle &f = bounds.on_f, &i = bounds.on_i;
  return {FootprintOf(f.middle.x, f.half.x, i.middle.x, i.half.x, side, w),
          FootprintOf(f.middle.y, f.half.y, i.middle.y, i.half.y, side, w)};
}

// a = tau (p - centre) at each q.
std::vector<double> ShiftsOf(const Footprint& footprint, double tau, Side side, double centre_m,
                             std::span<const double> q) {
  const double scale = side == Side::kFront ? 1 : tau;  // the footprint is one of tau p, or of p
  std::vector<double> a;
  for (const double one : q)
    a.push_back(scale * (footprint.middle + one * footprint.half) - tau * centre_m);
  return a;
}

// -1 .. 1.
std::vector<double> UniformNodes(int count) {
  std::vector<double> q;
  for (int k = 0; k < count; ++k) q.push_back(2.0 * k / (count - 1) - 1);
  return q;
}

// ---- tables ----

// Coefficients of the spline, [w][y][x][channel * 3 + component].
std::vector<float> SplineOf(const LightField& field, const LightBounds& bounds,
                            const LampTable& table) {
  const TableSize& size = table.size;
  const std::size_t components = kComponents * field.geometry.channels,
                    line = (size.x + 2) * components, slice = (size.y + 2) * line;
  const std::vector<double> q_x = UniformNodes(size.x), q_y = UniformNodes(size.y);
  std::vector<float> spline(size.coefficients() * components, 0.0f);
  for (int k = 0; k < size.w; ++k) {
    const double w = table.w_first + k * (table.w_last - table.w_first) / (size.w - 1);
    const std::vector<float> values = ExactSlice(field, bounds, table.side, w, q_x, q_y);
    for (int y = 0; y < size.y; ++y)
      std::copy_n(values.begin() + y * size.x * components, size.x * components,
                  spline.begin() + (k + 1) * slice + (y + 1) * line + components);
  }
  preprocess::SplineFromValues(spline.data(), (size.w + 2) * (size.y + 2), size.x, components);
  preprocess::SplineFromValues(spline.data(), size.w + 2, size.y, line);
  preprocess::SplineFromValues(spline.data(), 1, size.w, slice);
  return spline;
}

float LargestMagnitude(std::span<const float> values) {
  float largest = 0;
  for (const float value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

// Codes of the plane of one component.
Quantisation Quantise(double brightest, std::span<const float> plane,
                      std::span<std::int16_t> codes) {
  Quantisation q;
  if (brightest > 0) q.knee = kKneeShare * brightest;
  q.step = std::asinh(double(LargestMagnitude(plane)) / q.knee) / kLargestCode;
  if (q.step == 0) return q;
  for (std::size_t k = 0; k < plane.size(); ++k) {
    const double code = std::round(std::asinh(double(plane[k]) / q.knee) / q.step);
    codes[k] = static_cast<std::int16_t>(std::clamp(code, -kLargestCode, kLargestCode));
  }
  return q;
}

std::vector<double> BrightestOfSlices(const LampTable& table, int channels) {
  const std::size_t slices = static_cast<std::size_t>(table.size.w) + 2,
                    count = table.size.coefficients(), per_slice = count / slices;
  std::vector<double> brightest;
  for (std::size_t slice = 0; slice < slices; ++slice) {
    core::Rgb longest{};
    for (int channel = 0; channel < channels; ++channel) {
      const float* c =
          table.coefficients.data() + channel * kComponents * count + slice * per_slice;
      for (std::size_t k = 0; k < per_slice; ++k)
        longest[channel] = std::max(
            longest[channel],
            lightfield::Length({double(c[k]), double(c[count + k]), double(c[2 * count + k])}));
    }
    if (channels == 1) longest[1] = longest[2] = longest[0];
    brightest.push_back(core::Luminance(longest));
  }
  return brightest;
}

// w in spacings of the table from its first node.
double PlaceAmongSlices(const LampTable& table, double w) {
  return (w - table.w_first) / (table.w_last - table.w_first) * (table.size.w - 1);
}

// Where x lies among the nodes 0 .. nodes - 1.
struct Stencil {
  std::size_t first = 0;  // coefficient
  std::array<double, 4> weight{};

  Stencil(double position, int nodes) {
    const double cell = std::clamp(std::floor(position), 0.0, nodes - 2.0);
    first = static_cast<std::size_t>(cell);
    weight = preprocess::SplineWeights(position - cell);
  }
};

}  // namespace

LightBounds BoundsOfLight(const LightField& field, const std::string& name) {
  const LuminaireGeometry& g = field.geometry;
  const auto& lattice = g.lattice;
  Interval u, v, s, t;
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i)
      for (int channel = 0; channel < g.channels; ++channel) {
        const auto image = field.image(g.grid.index(i, j), channel);
        if (!AnyLight(image)) continue;
        const Vec2 centre = g.grid.centre(i, j);
        const double half = 0.5 * g.grid.basis.cells * g.grid.spacing_m;
        u.Widen(centre.x - half), u.Widen(centre.x + half);
        v.Widen(centre.y - half), v.Widen(centre.y + half);
        for (int r = 0; r < lattice.height; ++r) {
          const auto row =
              image.subspan(static_cast<std::size_t>(r) * lattice.width, lattice.width);
          const auto lit = [](float c) { return c != 0; };
          const auto first = std::find_if(row.begin(), row.end(), lit);
          if (first == row.end()) continue;
          const auto last = std::find_if(row.rbegin(), row.rend(), lit);
          s.Widen(lattice.s_of_column(double(first - row.begin())));
          s.Widen(lattice.s_of_column(double(row.rend() - last)));
          t.Widen(lattice.t_of_row(r)), t.Widen(lattice.t_of_row(r + 1));
        }
      }
  if (!(u.lo <= u.hi))
    throw InputError(name, "all of its coefficients are zero", "export a light field with light");
  return {Between(u, v), Between(s, t)};
}

std::vector<float> ExactSlice(const LightField& field, const LightBounds& bounds, Side side,
                              double w, std::span<const double> q_x, std::span<const double> q_y) {
  const LuminaireGeometry& g = field.geometry;
  const Vec2 centre = preprocess::SupportCentre(g);
  const double tau = side == Side::kFront ? w : 1 / w;
  const Footprints footprints = FootprintsOf(bounds, side, w);
  const std::vector<double> a_x = ShiftsOf(footprints.x, tau, side, centre.x, q_x),
                            a_y = ShiftsOf(footprints.y, tau, side, centre.y, q_y);
  const std::vector<float> moments = preprocess::TabulateMoments(field, a_x, a_y, tau);
  const double scale = side == Side::kFront ? 1 : tau * tau;
  const std::size_t width = q_x.size(), height = q_y.size(), components = kComponents * g.channels;
  std::vector<float> values(width * height * components);
  for (int channel = 0; channel < g.channels; ++channel)
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) {
        const float* moment =
            moments.data() +
            ((channel * (height + 2) + y + 1) * (width + 2) + x + 1) * kMomentStride;
        const double b0 = moment[0], b1_u = moment[1], b1_v = moment[2];
        float* k = values.data() + (y * width + x) * components + channel * kComponents;
        k[0] = static_cast<float>(scale * (tau * b1_u - a_x[x] * b0) / g.delta_m);
        k[1] = static_cast<float>(scale * (tau * b1_v - a_y[y] * b0) / g.delta_m);
        k[2] = static_cast<float>(-scale * b0);
      }
  return values;
}

LampVolume EmptyLampVolume(const LightField& field, const std::string& name) {
  LampVolume volume;
  volume.delta_m = field.geometry.delta_m;
  volume.channels = field.geometry.channels;
  volume.unit = field.geometry.unit;
  volume.bounds = BoundsOfLight(field, name);
  return volume;
}

LampTable BuildLampTable(const LightField& field, const LampVolume& volume, Side side,
                         double w_first, double w_last, const TableSize& size,
                         const std::string& name) {
  LampTable table;
  table.side = side;
  table.w_first = w_first;
  table.w_last = w_last;
  table.size = size;
  const std::vector<float> spline = SplineOf(field, volume.bounds, table);
  for (const float c : spline)
    if (!std::isfinite(c))
      throw InputError(name,
                       "its irradiance exceeds float32, or it holds values that are not finite",
                       "make it again with 'luxfield reconstruct', or scale it down");
  const std::size_t components = kComponents * field.geometry.channels, count = size.coefficients();
  table.coefficients.resize(spline.size());
  table.codes.assign(spline.size(), 0);
  for (std::size_t component = 0; component < components; ++component)
    for (std::size_t k = 0; k < count; ++k)
      table.coefficients[component * count + k] = spline[k * components + component];
  const auto plane = [&](std::size_t component) {
    return std::span(table.coefficients).subspan(component * count, count);
  };
  for (int channel = 0; channel < field.geometry.channels; ++channel) {
    const std::size_t first = kComponents * channel;
    const double brightest = double(LargestMagnitude(plane(first + 2)));
    for (std::size_t component = first; component < first + kComponents; ++component)
      table.quantisation.push_back(Quantise(
          brightest, plane(component), std::span(table.codes).subspan(component * count, count)));
  }
  FillFromCodes(table, field.geometry.channels);
  return table;
}

void FillFromCodes(LampTable& table, int channels) {
  const std::size_t count = table.size.coefficients();
  table.coefficients.resize(table.codes.size());
  for (std::size_t k = 0; k < table.codes.size(); ++k) {
    const Quantisation& q = table.quantisation[k / count];
    table.coefficients[k] = static_cast<float>(q.knee * std::sinh(q.step * table.codes[k]));
  }
  table.brightest = BrightestOfSlices(table, channels);
}

Vec3 PointAt(const LampVolume& volume, Vec2 q, double z_m) {
  const Side side = z_m >= volume.delta_m ? Side::kFront : Side::kBetween;
  const double w = side == Side::kFront ? volume.delta_m / z_m : z_m / volume.delta_m,
               scale = side == Side::kFront ? w : 1;
  const Footprints at = FootprintsOf(volume.bounds, side, w);
  return {(at.x.middle + q.x * at.x.half) / scale, (at.y.middle + q.y * at.y.half) / scale, z_m};
}

const LampTable* TableAt(const LampVolume& volume, double z_m) {
  const Side side = z_m >= volume.delta_m ? Side::kFront : Side::kBetween;
  const double w = side == Side::kFront ? volume.delta_m / z_m : z_m / volume.delta_m;
  for (const LampTable& table : volume.tables)
    if (table.side == side && w >= table.w_first && w <= table.w_last) return &table;
  return nullptr;
}

LightVector LightVectorAt(const LampVolume& volume, Vec3 p) {
  LightVector vector;
  const LampTable* table = p.z > 0 ? TableAt(volume, p.z) : nullptr;
  if (!table) return vector;
  const bool front = table->side == Side::kFront;
  const double w = front ? volume.delta_m / p.z : p.z / volume.delta_m, scale = front ? w : 1;
  const Footprints at = FootprintsOf(volume.bounds, table->side, w);
  const double q_x = (scale * p.x - at.x.middle) / at.x.half,
               q_y = (scale * p.y - at.y.middle) / at.y.half;
  if (!(std::abs(q_x) <= 1 && std::abs(q_y) <= 1)) return vector;
  const TableSize& size = table->size;
  const Stencil x(0.5 * (q_x + 1) * (size.x - 1), size.x),
      y(0.5 * (q_y + 1) * (size.y - 1), size.y), k(PlaceAmongSlices(*table, w), size.w);
  const std::size_t line = size.x + 2, slice = (size.y + 2) * line, count = size.coefficients();
  for (int channel = 0; channel < volume.channels; ++channel) {
    std::array<double, kComponents> sum{};
    for (int component = 0; component < kComponents; ++component) {
      const float* c = table->coefficients.data() + (channel * kComponents + component) * count;
      for (std::size_t n = 0; n < 64; ++n) {
        const std::size_t i = n % 4, j = n / 4 % 4, l = n / 16;
        sum[component] += x.weight[i] * y.weight[j] * k.weight[l] *
                          double(c[(k.first + l) * slice + (y.first + j) * line + x.first + i]);
      }
    }
    vector.j[channel] = (scale * scale) * Vec3{sum[0], sum[1], sum[2]};
  }
  if (volume.channels == 1) vector.j[1] = vector.j[2] = vector.j[0];
  return vector;
}

Horizon HorizonOf(const LampVolume& volume, Vec3 p, Vec3 n) {
  const Rectangle& f = volume.bounds.on_f;
  int before = 0;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0}) {
      const Vec3 corner{f.middle.x + x * f.half.x, f.middle.y + y * f.half.y, 0};
      before += lightfield::Dot(n, corner - p) >= 0;
    }
  return before == 4 ? Horizon::kBefore : before == 0 ? Horizon::kBehind : Horizon::kCut;
}

double IlluminanceAt(const LampVolume& volume, Vec3 p, Vec3 n) {
  const Horizon horizon = HorizonOf(volume, p, n);
  if (horizon == Horizon::kBehind) return 0;
  const LightVector vector = LightVectorAt(volume, p);
  core::Rgb e{};
  for (int channel = 0; channel < 3; ++channel) e[channel] = lightfield::Dot(n, vector.j[channel]);
  const double illuminance = core::Luminance(e);
  return horizon == Horizon::kCut ? std::max(0.0, illuminance) : illuminance;
}

double BrightestAt(const LampVolume& volume, double z_m) {
  const LampTable* table = z_m > 0 ? TableAt(volume, z_m) : nullptr;
  if (!table) return 0;
  const bool front = table->side == Side::kFront;
  const double w = front ? volume.delta_m / z_m : z_m / volume.delta_m, scale = front ? w : 1;
  const auto slice = static_cast<std::size_t>(std::round(PlaceAmongSlices(*table, w))) + 1;
  return scale * scale * table->brightest[slice];
}

}  // namespace luxfield::web
