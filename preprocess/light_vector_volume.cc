#include "luxfield/preprocess/light_vector_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/projected_texels.h"
#include "luxfield/preprocess/cubic_spline.h"

namespace luxfield::preprocess {
namespace {

using lightfield::FieldColumns;
using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::PencilAxis;
using lightfield::ProjectedTexels;
using lightfield::TexelAxis;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr int kComponents = 4;           // B0, B1_u, B1_v, padding: one float4
constexpr double kNodeMargin = 0.01;     // of a spacing, so that rounding keeps receivers inside
constexpr int kNodesPerTask = 16;        // node rows that share a pass over the images
constexpr std::size_t kRowsPerSum = 32;  // added in float32

// ---- one slice of tau ----

// Texel weights of every node and basis function first .. first + functions - 1 of one axis:
// [node * functions + function].
std::vector<ProjectedTexels> AxisWeights(const LuminaireGeometry& g, std::span<const double> nodes,
                                         double tau, bool rows, int first, int functions) {
  const TexelAxis texels = rows ? TexelAxis::Rows(g.lattice) : TexelAxis::Columns(g.lattice);
  const Vec2 centre = SupportCentre(g);
  const double corner = rows ? g.grid.v0_m : g.grid.u0_m, origin = rows ? centre.y : centre.x;
  std::vector<ProjectedTexels> weights(nodes.size() * functions);
  core::ParallelFor(nodes.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t node = begin; node < end; ++node) {
      // w = u - centre, s = centre + a + (1 - tau) w
      const PencilAxis pencil{origin + nodes[node], origin, 1 - tau, 0};
      for (int i = 0; i < functions; ++i)
        weights[node * functions + i] =
            ProjectTexels(g.grid.basis, corner, g.grid.spacing_m, first + i, texels, pencil);
    }
  });
  return weights;
}

typedef float Lanes __attribute__((vector_size(64)));
constexpr int kLanes = 16;

// sum0[c] += sum_r w0[r] texels[r][c], sum1 likewise, for one block of at most 16 columns.
void AddRows(const float* texels, std::size_t stride, const float* w0, const float* w1,
             std::size_t rows, int columns, double* sum0, double* sum1) {
  Lanes a = {}, b = {};
  for (std::size_t r = 0; r < rows; ++r) {
    Lanes t = {};
    if (columns == kLanes)
      std::memcpy(&t, texels + r * stride, sizeof t);
    else
      std::memcpy(&t, texels + r * stride, columns * sizeof(float));
    a += w0[r] * t;
    b += w1[r] * t;
  }
  for (int c = 0; c < columns; ++c) {
    sum0[c] += static_cast<double>(a[c]);
    sum1[c] += static_cast<double>(b[c]);
  }
}

// The images of grid column i summed over rows with the weights of one node of a_y.
class ColumnSums {
 public:
  explicit ColumnSums(int width)
      : zeroth(width), moment(width), zeroth_sum_(width), moment_sum_(width) {}

  std::vector<float> zeroth, moment;  // per texel column: what becomes B0 and B1_v

  // Fills texel columns [begin, end); rows[j] are the node's weights.
  void Fill(const LightField& field, int channel, int i, const ProjectedTexels* rows, int begin,
            int end) {
    const LuminaireGeometry& g = field.geometry;
    const std::size_t width = g.lattice.width;
    std::fill(zeroth_sum_.begin() + begin, zeroth_sum_.begin() + end, 0.0);
    std::fill(moment_sum_.begin() + begin, moment_sum_.begin() + end, 0.0);
    for (int j = 0; j < g.grid.height; ++j) {
      const ProjectedTexels& window = rows[j];
      w0_.assign(window.zeroth.begin(), window.zeroth.end());
      w1_.assign(window.moment.begin(), window.moment.end());
      const float* image = field.image(g.grid.index(i, j), channel).data() + window.first * width;
      for (std::size_t r = 0; r < window.size(); r += kRowsPerSum)
        for (int c = begin; c < end; c += kLanes)
          AddRows(image + r * width + c, width, w0_.data() + r, w1_.data() + r,
                  std::min(kRowsPerSum, window.size() - r), std::min(kLanes, end - c),
                  zeroth_sum_.data() + c, moment_sum_.data() + c);
    }
    std::copy(zeroth_sum_.begin() + begin, zeroth_sum_.begin() + end, zeroth.begin() + begin);
    std::copy(moment_sum_.begin() + begin, moment_sum_.begin() + end, moment.begin() + begin);
  }

 private:
  std::vector<double> zeroth_sum_, moment_sum_;
  std::vector<float> w0_, w1_;
};

struct NodeSum {
  double b0 = 0, b1_u = 0, b1_v = 0;
};

// Adds what a group of columns brings to node rows [begin, end) of one slice and channel; `sums` are
// the slice's, [a_y][a_x].
void AddNodeRows(const LightField& group, int channel, std::size_t nodes,
                 const std::vector<ProjectedTexels>& columns,
                 const std::vector<ProjectedTexels>& rows, std::size_t begin, std::size_t end,
                 NodeSum* sums) {
  const auto& grid = group.geometry.grid;
  ColumnSums image_sums(group.geometry.lattice.width);
  for (int i = 0; i < grid.width; ++i) {
    int first = group.geometry.lattice.width, last = 0;
    for (std::size_t x = 0; x < nodes; ++x) {
      const ProjectedTexels& window = columns[x * grid.width + i];
      if (window.size() == 0) continue;
      first = std::min(first, window.first);
      last = std::max(last, window.first + static_cast<int>(window.size()));
    }
    if (first >= last) continue;
    for (std::size_t y = begin; y < end; ++y) {
      image_sums.Fill(group, channel, i, &rows[y * grid.height], first, last);
      for (std::size_t x = 0; x < nodes; ++x) {
        const ProjectedTexels& window = columns[x * grid.width + i];
        NodeSum& sum = sums[y * nodes + x];
        const auto texels = [&](const std::vector<float>& values) {
          return std::span(values).subspan(window.first, window.size());
        };
        const auto even =
            lightfield::WeightedSums(texels(image_sums.zeroth), window.zeroth, window.moment);
        const auto odd =
            lightfield::WeightedSums(texels(image_sums.moment), window.zeroth, window.zeroth);
        sum.b0 += even.a;
        sum.b1_u += even.b;
        sum.b1_v += odd.a;
      }
    }
  }
}

// Adds the moments of a group, the columns of `whole` from number `first` on, at one tau: `sums` of
// channel c, [a_y][a_x], start at number c * stride.
void AddMoments(const LightField& group, const LuminaireGeometry& whole, int first,
                std::span<const double> a_x, std::span<const double> a_y, double tau,
                std::size_t stride, NodeSum* sums) {
  const auto columns = AxisWeights(whole, a_x, tau, false, first, group.geometry.grid.width),
             rows = AxisWeights(whole, a_y, tau, true, 0, whole.grid.height);
  const std::size_t pieces = (a_y.size() + kNodesPerTask - 1) / kNodesPerTask;
  core::ParallelFor(pieces * whole.channels, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece) {
      const std::size_t channel = piece / pieces, row = piece % pieces * kNodesPerTask;
      AddNodeRows(group, static_cast<int>(channel), a_x.size(), columns, rows, row,
                  std::min(row + kNodesPerTask, a_y.size()), sums + channel * stride);
    }
  });
}

// A slice of sums, [a_y][a_x], as coefficients with a border.
void StoreSlice(const NodeSum* sums, std::size_t a_x, std::size_t a_y, float* slice) {
  for (std::size_t y = 0; y < a_y; ++y)
    for (std::size_t x = 0; x < a_x; ++x) {
      const NodeSum& sum = sums[y * a_x + x];
      float* node = slice + ((y + 1) * (a_x + 2) + x + 1) * kComponents;
      node[0] = static_cast<float>(sum.b0);
      node[1] = static_cast<float>(sum.b1_u);
      node[2] = static_cast<float>(sum.b1_v);
    }
}

Interval Widened(const Interval& range, double least) {
  const double missing = std::max(0.0, least - (range.hi - range.lo));
  return {range.lo - 0.5 * missing, range.hi + 0.5 * missing};
}

VolumeAxis MakeAxis(const Interval& range, int nodes) {
  const double spacing = (range.hi - range.lo) / (nodes - 1 - 2 * kNodeMargin);
  return {range.lo - kNodeMargin * spacing, spacing, nodes};
}

std::vector<double> NodesOf(const VolumeAxis& axis) {
  std::vector<double> nodes(axis.nodes);
  for (int k = 0; k < axis.nodes; ++k) nodes[k] = axis.first + k * axis.spacing;
  return nodes;
}

bool Inside(const VolumeAxis& axis, double x) {
  return axis.nodes > 0 && x >= axis.first && x <= axis.first + (axis.nodes - 1) * axis.spacing;
}

// Where x lies on an axis that it is inside of.
struct Stencil {
  std::size_t first = 0;  // coefficient
  std::array<double, 4> weight{};

  Stencil(const VolumeAxis& axis, double x) {
    const double position = (x - axis.first) / axis.spacing;
    const double cell = std::clamp(std::floor(position), 0.0, axis.nodes - 2.0);
    first = static_cast<std::size_t>(cell);
    weight = SplineWeights(position - cell);
  }
};

}  // namespace

Vec2 SupportCentre(const LuminaireGeometry& geometry) {
  const auto& grid = geometry.grid;
  const double half = 0.5 * grid.spacing_m, ramp = grid.basis.cells - 1;
  return {grid.u0_m + half * (grid.width + ramp), grid.v0_m + half * (grid.height + ramp)};
}

VolumeCoordinates CoordinatesOf(const LuminaireGeometry& geometry, Vec3 p) {
  const Vec2 centre = SupportCentre(geometry);
  const double tau = geometry.delta_m / p.z;
  return {tau * (p.x - centre.x), tau * (p.y - centre.y), tau};
}

bool SeesImages(const LuminaireGeometry& geometry, Vec3 p) {
  if (!(p.z > 0)) return false;
  const auto& lattice = geometry.lattice;
  const Vec2 centre = SupportCentre(geometry);
  const VolumeCoordinates at = CoordinatesOf(geometry, p);
  const double shrink = std::abs(1 - at.tau);
  const double half_s = shrink * (centre.x - geometry.grid.u0_m),
               half_t = shrink * (centre.y - geometry.grid.v0_m);
  const double s = centre.x + at.a_x_m, t = centre.y + at.a_y_m;
  return s + half_s >= lattice.s0_m && s - half_s <= lattice.s0_m + lattice.extent_s_m() &&
         t - half_t <= lattice.t1_m && t + half_t >= lattice.t1_m - lattice.extent_t_m();
}

double MaxTau(const LuminaireGeometry& geometry) {
  const double texel_m = std::max(geometry.lattice.ds_m, geometry.lattice.dt_m);
  return std::max(0.5, 1 - texel_m / geometry.grid.spacing_m);
}

bool VolumeLights(const LuminaireGeometry& geometry, const Receiver& receiver, double max_tau) {
  return SeesImages(geometry, receiver.p) && geometry.delta_m <= max_tau * receiver.p.z &&
         !lightfield::HorizonCutsSupport(geometry, receiver.p, receiver.n);
}

Reach ReachOf(const LuminaireGeometry& geometry, std::span<const Receiver> receivers,
              double max_tau) {
  Reach reach;
  for (const Receiver& receiver : receivers) {
    if (!VolumeLights(geometry, receiver, max_tau)) continue;
    const VolumeCoordinates at = CoordinatesOf(geometry, receiver.p);
    reach.a_x_m.Widen(at.a_x_m);
    reach.a_y_m.Widen(at.a_y_m);
    reach.tau.Widen(at.tau);
  }
  return reach;
}

Reach WidenNarrowAxes(const LuminaireGeometry& geometry, const Reach& reach) {
  if (reach.empty()) return reach;
  const double least_m = 0.1 * geometry.grid.spacing_m;
  return {Widened(reach.a_x_m, least_m), Widened(reach.a_y_m, least_m), Widened(reach.tau, 0.01)};
}

bool LightVectorVolume::Covers(const VolumeCoordinates& at) const {
  return Inside(a_x, at.a_x_m) && Inside(a_y, at.a_y_m) && Inside(tau, at.tau);
}

std::size_t VolumeBytes(const VolumeResolution& resolution, int channels) {
  const auto axis = [](int nodes) { return static_cast<std::size_t>(nodes) + 2; };
  return axis(resolution.a_x) * axis(resolution.a_y) * axis(resolution.tau) * channels *
         kComponents * sizeof(float);
}

std::vector<float> TabulateMoments(const LightField& field, std::span<const double> a_x,
                                   std::span<const double> a_y, double tau) {
  const LuminaireGeometry& g = field.geometry;
  const std::size_t nodes = a_x.size() * a_y.size(),
                    slice = (a_x.size() + 2) * (a_y.size() + 2) * kComponents;
  std::vector<NodeSum> sums(g.channels * nodes);
  AddMoments(field, g, 0, a_x, a_y, tau, nodes, sums.data());
  std::vector<float> moments(g.channels * slice, 0.0f);
  for (int channel = 0; channel < g.channels; ++channel)
    StoreSlice(sums.data() + channel * nodes, a_x.size(), a_y.size(),
               moments.data() + channel * slice);
  return moments;
}

LightVectorVolume BuildLightVectorVolume(const FieldColumns& field, const Reach& reach,
                                         const VolumeResolution& resolution) {
  const LuminaireGeometry& g = field.geometry();
  if (std::min({resolution.a_x, resolution.a_y, resolution.tau}) < 4)
    throw InputError(
        fmt::format("a light-vector volume of {} x {} x {} nodes; at least 4 per axis "
                    "are needed",
                    resolution.a_x, resolution.a_y, resolution.tau));
  LightVectorVolume volume;
  volume.geometry = g;
  if (reach.empty()) return volume;
  const Reach wide = WidenNarrowAxes(g, reach);
  volume.a_x = MakeAxis(wide.a_x_m, resolution.a_x);
  volume.a_y = MakeAxis(wide.a_y_m, resolution.a_y);
  volume.tau = MakeAxis(wide.tau, resolution.tau);
  const auto a_x = NodesOf(volume.a_x), a_y = NodesOf(volume.a_y), tau = NodesOf(volume.tau);
  const std::size_t nodes = a_x.size() * a_y.size(), table = tau.size() * nodes;
  std::vector<NodeSum> sums(g.channels * table);
  field.ForEachGroup([&](const LightField& group, int first) {
    for (std::size_t k = 0; k < tau.size(); ++k)
      AddMoments(group, g, first, a_x, a_y, tau[k], table, sums.data() + k * nodes);
  });

  volume.coefficients.assign(VolumeBytes(resolution, g.channels) / sizeof(float), 0.0f);
  const std::size_t line = volume.a_x.coefficients() * kComponents,
                    slice = volume.a_y.coefficients() * line, slices = volume.tau.coefficients();
  for (int channel = 0; channel < g.channels; ++channel)
    for (std::size_t k = 0; k < tau.size(); ++k)
      StoreSlice(sums.data() + channel * table + k * nodes, a_x.size(), a_y.size(),
                 volume.coefficients.data() + (channel * slices + k + 1) * slice);
  float* data = volume.coefficients.data();
  const std::size_t channels = g.channels;
  SplineFromValues(data, channels * slices * volume.a_y.coefficients(), volume.a_x.nodes,
                   kComponents);
  SplineFromValues(data, channels * slices, volume.a_y.nodes, line);
  SplineFromValues(data, channels, volume.tau.nodes, slice);
  for (const float c : volume.coefficients)
    if (!std::isfinite(c))
      throw InputError(
          "the light-vector volume exceeds float32, or the light field holds values that are not "
          "finite; make it again with 'luxfield reconstruct', or scale it down");
  return volume;
}

std::optional<lightfield::LightVector> InterpolateLightVector(const LightVectorVolume& volume,
                                                              Vec3 p) {
  const LuminaireGeometry& g = volume.geometry;
  lightfield::LightVector vector;
  if (!SeesImages(g, p)) return vector;
  const VolumeCoordinates at = CoordinatesOf(g, p);
  if (!volume.Covers(at)) return std::nullopt;
  const Stencil x(volume.a_x, at.a_x_m), y(volume.a_y, at.a_y_m), tau(volume.tau, at.tau);
  const Vec2 centre = SupportCentre(g);
  const std::size_t line = volume.a_x.coefficients(), slice = volume.a_y.coefficients() * line,
                    table = volume.tau.coefficients() * slice;
  for (int channel = 0; channel < g.channels; ++channel) {
    double b0 = 0, b1_u = 0, b1_v = 0;
    for (std::size_t k = 0; k < 64; ++k) {
      const std::size_t i = k % 4, j = k / 4 % 4, l = k / 16;
      const float* c =
          volume.coefficients.data() + kComponents * (channel * table + (tau.first + l) * slice +
                                                      (y.first + j) * line + x.first + i);
      const double weight = x.weight[i] * y.weight[j] * tau.weight[l];
      b0 += weight * static_cast<double>(c[0]);
      b1_u += weight * static_cast<double>(c[1]);
      b1_v += weight * static_cast<double>(c[2]);
    }
    vector.j[channel] = (at.tau * at.tau / p.z) *
                        Vec3{b1_u - (p.x - centre.x) * b0, b1_v - (p.y - centre.y) * b0, -p.z * b0};
  }
  if (g.channels == 1) vector.j[1] = vector.j[2] = vector.j[0];
  return vector;
}

}  // namespace luxfield::preprocess
