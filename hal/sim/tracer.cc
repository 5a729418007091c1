#include "luxfield/hal/sim/tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"

namespace luxfield::hal::sim {
namespace {

struct Node {
  double x = 0, weight = 0;
};

// Gauss-Legendre on [0, 1]: Newton's method on the recurrence of P_n.
std::vector<Node> GaussLegendre(int count) {
  std::vector<Node> nodes(count);
  for (int k = 0; k < count; ++k) {
    double x = std::cos(std::numbers::pi * (k + 0.75) / (count + 0.5)), derivative = 1;
    for (int iteration = 0; iteration < 50; ++iteration) {
      double p0 = 1, p1 = x;
      for (int n = 2; n <= count; ++n)
        p0 = std::exchange(p1, ((2 * n - 1) * x * p1 - (n - 1) * p0) / n);
      derivative = count * (x * p1 - p0) / (x * x - 1);
      const double step = p1 / derivative;
      x -= step;
      if (std::abs(step) < 1e-15) break;
    }
    nodes[k] = {0.5 * (1 + x), 1 / ((1 - x * x) * derivative * derivative)};
  }
  return nodes;
}

// A point of F that light passes, and the poses whose filter covers it.
struct Sample {
  Vec2 u;
  std::vector<std::pair<int, double>> poses;  // pose and quadrature weight x transmittance
};

std::vector<Sample> MakeSamples(const Lamp& lamp, const TransmittanceFunction& transmittance,
                                double half_width, const std::vector<FilterPose>& poses,
                                const TraceOptions& o) {
  Vec2 low = poses.front().centre, high = low;
  for (const FilterPose& pose : poses) {
    low = {std::min(low.x, pose.centre.x), std::min(low.y, pose.centre.y)};
    high = {std::max(high.x, pose.centre.x), std::max(high.y, pose.centre.y)};
  }
  const auto cell_range = [&](double from, double to, double origin) {
    // A support that ends on a cell's edge does not enter the next cell, rounding or not.
    return std::pair{static_cast<int>(std::floor((from - half_width - origin) / o.cell_m + 1e-9)),
                     static_cast<int>(std::ceil((to + half_width - origin) / o.cell_m - 1e-9))};
  };
  const auto [first_x, end_x] = cell_range(low.x, high.x, o.cell_origin.x);
  const auto [first_y, end_y] = cell_range(low.y, high.y, o.cell_origin.y);
  const auto nodes = GaussLegendre(o.u_samples_per_cell);
  std::vector<Sample> samples;
  for (int cell_y = first_y; cell_y < end_y; ++cell_y)
    for (int cell_x = first_x; cell_x < end_x; ++cell_x)
      for (const Node& ny : nodes)
        for (const Node& nx : nodes) {
          Sample sample{{o.cell_origin.x + (cell_x + nx.x) * o.cell_m,
                         o.cell_origin.y + (cell_y + ny.x) * o.cell_m},
                        {}};
          if (lamp.DarkAt(sample.u)) continue;
          const double weight = nx.weight * ny.weight * o.cell_m * o.cell_m;
          for (std::size_t p = 0; p < poses.size(); ++p) {
            const Vec2 offset = sample.u - poses[p].centre;
            if (std::abs(offset.x) > half_width || std::abs(offset.y) > half_width) continue;
            const double t = transmittance(offset, poses[p].print);
            if (t != 0) sample.poses.emplace_back(static_cast<int>(p), weight * t);
          }
          if (!sample.poses.empty()) samples.push_back(std::move(sample));
        }
  return samples;
}

constexpr int kChunk =
    128;  // texels of a row traced together: 110 poses of accumulators stay in the cache

}  // namespace

std::vector<std::vector<float>> TraceIrradiance(
    const Lamp& lamp, const TransmittanceFunction& transmittance, double half_width_m,
    const std::vector<FilterPose>& poses, const lightfield::Lattice& lattice,
    const std::vector<LatticeWindow>& windows, const TraceOptions& o) {
  const int channels = lamp.traced_channels();
  std::vector<std::vector<float>> images(poses.size());
  for (std::size_t p = 0; p < poses.size(); ++p)
    images[p].assign(static_cast<std::size_t>(channels) * windows[p].width * windows[p].height,
                     0.0f);
  if (poses.empty()) return images;
  const auto samples = MakeSamples(lamp, transmittance, half_width_m, poses, o);
  const int chunks = (lattice.width + kChunk - 1) / kChunk, sub = o.s_samples_per_texel;
  const double delta2 = o.delta_m * o.delta_m;
  core::Progress progress("tracing light", static_cast<std::uint64_t>(lattice.height));

  core::ParallelFor(
      static_cast<std::size_t>(lattice.height), 1, [&](std::size_t row_begin, std::size_t row_end) {
        const int points = kChunk * sub;
        std::vector<double> s(points), radiance(static_cast<std::size_t>(channels) * points);
        std::vector<double> sums;
        std::vector<char> needed(poses.size());
        for (auto row = static_cast<int>(row_begin); row < static_cast<int>(row_end); ++row) {
          for (int chunk = 0; chunk < chunks; ++chunk) {
            const int begin = chunk * kChunk, count = std::min(kChunk, lattice.width - begin),
                      fine = count * sub;
            for (std::size_t p = 0; p < poses.size(); ++p) {
              const LatticeWindow& w = windows[p];
              needed[p] = row >= w.row && row < w.row + w.height && begin < w.column + w.width &&
                          begin + count > w.column;
            }
            sums.assign(poses.size() * channels * fine, 0.0);
            for (int k = 0; k < fine; ++k) s[k] = lattice.s_of_column(begin + (k + 0.5) / sub);
            for (int sub_row = 0; sub_row < sub; ++sub_row) {
              const double t = lattice.t_of_row(row + (sub_row + 0.5) / sub);
              for (const Sample& sample : samples) {
                if (std::none_of(sample.poses.begin(), sample.poses.end(),
                                 [&](const auto& use) { return needed[use.first]; }))
                  continue;
                const std::span<double> light(radiance.data(),
                                              static_cast<std::size_t>(channels) * fine);
                lamp.Radiance(sample.u, o.delta_m, t, std::span<const double>(s.data(), fine),
                              light);
                const double dy = t - sample.u.y;
                bool lit = false;
                for (int channel = 0; channel < channels; ++channel)
                  for (int k = 0; k < fine; ++k) {
                    // cos^4 / delta^2 = delta^2 / (delta^2 + |u - s|^2)^2
                    const double dx = s[k] - sample.u.x, d2 = delta2 + dx * dx + dy * dy;
                    double& l = light[channel * fine + k];
                    lit |= l != 0;
                    l *= delta2 / (d2 * d2);
                  }
                if (!lit) continue;
                for (const auto& [p, weight] : sample.poses) {
                  if (!needed[p]) continue;
                  double* sum = sums.data() + static_cast<std::size_t>(p) * channels * fine;
                  for (int k = 0; k < channels * fine; ++k) sum[k] += weight * light[k];
                }
              }
            }
            for (std::size_t p = 0; p < poses.size(); ++p) {
              if (!needed[p]) continue;
              const LatticeWindow& w = windows[p];
              for (int channel = 0; channel < channels; ++channel)
                for (int k = std::max(0, w.column - begin);
                     k < std::min(count, w.column + w.width - begin); ++k) {
                  double mean = 0;
                  for (int n = 0; n < sub; ++n)
                    mean += sums[(p * channels + channel) * fine + k * sub + n];
                  images[p]
                        [(static_cast<std::size_t>(channel) * w.height + (row - w.row)) * w.width +
                         (begin + k - w.column)] = static_cast<float>(mean / (sub * sub));
                }
            }
          }
          progress.Advance();
        }
      });
  return images;
}

}  // namespace luxfield::hal::sim
