#include "reconstruct/rim_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr double kPi = std::numbers::pi;
constexpr int kSearchSide = 192;  // pixels of the reduced picture
constexpr double kStep = 0.25;    // of profiles, pixels
constexpr double kTukey = 4.685;  // 95 % efficient on normal residuals (Holland and Welsch 1977)
constexpr int kLeastRays = 64;

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Bilinear between pixel centres, constant beyond the borders.
double At(const core::Image& image, double x, double y) {
  const double u = std::clamp(x - 0.5, 0.0, image.width - 1.0),
               v = std::clamp(y - 0.5, 0.0, image.height - 1.0);
  const int column = std::min(static_cast<int>(u), image.width - 2),
            row = std::min(static_cast<int>(v), image.height - 2);
  const double a = u - column, b = v - row;
  return (1 - b) * ((1 - a) * image.at(0, row, column) + a * image.at(0, row, column + 1)) +
         b * ((1 - a) * image.at(0, row + 1, column) + a * image.at(0, row + 1, column + 1));
}

// Means over blocks, then the logarithm above a floor: ranges of 17 stops have edges everywhere.
core::Image Reduced(const core::Image& picture, int block) {
  core::Image small(picture.width / block, picture.height / block, 1);
  for (int row = 0; row < small.height; ++row)
    for (int column = 0; column < small.width; ++column) {
      double sum = 0;
      for (int y = 0; y < block; ++y)
        for (int x = 0; x < block; ++x)
          sum += std::max(0.0f, picture.at(0, row * block + y, column * block + x));
      small.at(0, row, column) = static_cast<float>(sum / (block * block));
    }
  std::vector<double> values(small.data.begin(), small.data.end());
  const double floor = std::max(1e-3 * MedianOf(values), 1e-30);
  for (float& value : small.data) value = static_cast<float>(std::log(value + floor));
  return small;
}

// Mean over the circle of the logarithm's step across it, each point's cut at 1 so that no lamp
// outvotes the rim.
double MeanStep(const core::Image& log_picture, Circle circle) {
  constexpr int kAngles = 180;
  double sum = 0;
  for (int k = 0; k < kAngles; ++k) {
    const double c = std::cos(2 * kPi * k / kAngles), s = std::sin(2 * kPi * k / kAngles);
    const auto at = [&](double r) { return At(log_picture, circle.x + r * c, circle.y + r * s); };
    sum += std::min(1.0, std::abs(at(circle.radius + 1) - at(circle.radius - 1)));
  }
  return sum / kAngles;
}

Circle SearchCircle(const core::Image& picture, const std::string& file) {
  const int block =
      std::max(1, (std::max(picture.width, picture.height) + kSearchSide - 1) / kSearchSide);
  const core::Image small = Reduced(picture, block);
  const int w = small.width, h = small.height;
  const int longest = std::min(w, h) * 3 / 5, shortest = std::min(w, h) / 8;
  if (shortest < 4)
    throw InputError(file, fmt::format("{} x {} pixels are too few", picture.width, picture.height),
                     "give a picture of at least 64 pixels");

  // Each edge votes for the centres that its gradient points at or away from.
  struct Edge {
    double x, y, dx, dy, strength;
  };
  std::vector<Edge> edges;
  for (int row = 1; row + 1 < h; ++row)
    for (int column = 1; column + 1 < w; ++column) {
      const double dx = small.at(0, row, column + 1) - small.at(0, row, column - 1),
                   dy = small.at(0, row + 1, column) - small.at(0, row - 1, column);
      const double strength = std::hypot(dx, dy);
      if (strength > 0.05)
        edges.push_back(
            {column + 0.5, row + 0.5, dx / strength, dy / strength, std::min(strength, 1.0)});
    }
  core::Image votes(w, h, 1);
  for (const Edge& edge : edges)
    for (const int sense : {-1, 1})
      for (int r = shortest; r <= longest; ++r) {
        const int column = static_cast<int>(std::floor(edge.x + sense * r * edge.dx)),
                  row = static_cast<int>(std::floor(edge.y + sense * r * edge.dy));
        if (row >= 0 && row < h && column >= 0 && column < w)
          votes.at(0, row, column) += static_cast<float>(edge.strength);
      }

  // Around the best centres the circle with the steepest mean step.
  Circle best;
  double best_step = 0.1;
  for (int candidate = 0; candidate < 8; ++candidate) {
    const auto top = std::max_element(votes.data.begin(), votes.data.end());
    if (*top <= 0) break;
    const int index = static_cast<int>(top - votes.data.begin()), row = index / w,
              column = index % w;
    for (int y = row - 1; y <= row + 1; ++y)
      for (int x = column - 1; x <= column + 1; ++x)
        for (int r = shortest; r <= longest; ++r) {
          const Circle circle = {x + 0.5, y + 0.5, double(r)};
          if (const double step = MeanStep(small, circle); step > best_step)
            best_step = step, best = circle;
        }
    for (int y = std::max(0, row - 3); y <= std::min(h - 1, row + 3); ++y)
      for (int x = std::max(0, column - 3); x <= std::min(w - 1, column + 3); ++x)
        votes.at(0, y, x) = 0;
  }
  if (best.radius == 0)
    throw InputError(file, "shows no circle that stands out", "give [rim] centre_px and radius_px");
  return {best.x * block, best.y * block, best.radius * block};
}

// A sharp edge as profiles show it: pixels are boxes, and what bilinear interpolation makes of them
// is blurred by a quadratic B-spline, box three times over. Values at distances d inside of the
// edge.
constexpr double kBlurVariance = 0.25;  // of that B-spline, square pixels

class BlurredEdge {
 public:
  static constexpr int kOrders = 2;
  static constexpr double kFine = 0.05;  // pixels; divides kStep

  // With the shadings d^exponent and d^(2 exponent) inside, beside the edge's step.
  explicit BlurredEdge(double exponent) {
    constexpr int kPoints = 60;
    for (int k = 0; k < kSize; ++k) {
      const double d = (k - kSize / 2) * kFine;
      for (int i = 0; i < kPoints; ++i) {
        const double t = -1.5 + (i + 0.5) * 3 / kPoints, size = std::abs(t);
        const double kernel = size < 0.5 ? 0.75 - t * t : 0.5 * (1.5 - size) * (1.5 - size);
        if (d - t <= 0) continue;
        step_[k] += kernel * 3 / kPoints;
        for (int order = 0; order < kOrders; ++order)
          shades_[order][k] += kernel * std::pow(d - t, exponent * (order + 1)) * 3 / kPoints;
      }
    }
  }
  double step(int fine) const { return step_[fine + kSize / 2]; }
  double shade(int order, int fine) const { return shades_[order][fine + kSize / 2]; }

 private:
  static constexpr int kSize = 401;
  std::array<double, kSize> step_{};
  std::array<std::array<double, kSize>, kOrders> shades_{};
};

// Next to a ball's rim the direction seen turns with the root of the distance to it, so that the
// radiance is a power series in that root; next to a lens' one in the distance.
const BlurredEdge& EdgeOf(ProbeOptics::Kind kind) {
  static const BlurredEdge ball(0.5), lens(1);
  return kind == ProbeOptics::Kind::kBall ? ball : lens;
}

// A place on the rim as seen along one ray.
struct RimPoint {
  Vec2 p;
  bool seen = false;
};

// The rim within +-window of the circle along a direction, with so many orders of shading.
RimPoint FindStep(const core::Image& picture, const BlurredEdge& edge, int orders,
                  const Circle& circle, double angle, double window) {
  const double c = std::cos(angle), s = std::sin(angle);
  constexpr double kInside = 5, kOutside = 3, kMove = 1.25;  // pixels about the steepest place
  const double reach = window + kInside + 1;
  const auto inside_picture = [&](double r) {
    const double x = circle.x + r * c, y = circle.y + r * s;
    return x > 0 && y > 0 && x < picture.width && y < picture.height;
  };
  if (!inside_picture(circle.radius + reach) || !inside_picture(circle.radius - reach)) return {};
  const int count = static_cast<int>(2 * reach / kStep) + 1;
  std::vector<double> profile(count);
  for (int k = 0; k < count; ++k) {
    const double r = circle.radius - reach + k * kStep;
    profile[k] = At(picture, circle.x + r * c, circle.y + r * s);
  }
  // Steepest change of the logarithm over two pixels.
  const double floor = 1e-4 * *std::max_element(profile.begin(), profile.end()) + 1e-30;
  const auto log_at = [&](int k) { return std::log(std::max(profile[k], 0.0) + floor); };
  const int span = static_cast<int>(1 / kStep), inside = static_cast<int>(kInside / kStep),
            outside = static_cast<int>(kOutside / kStep);
  int steepest = -1;
  double change = 0.02;
  for (int k = inside; k + outside < count; ++k)
    if (const double d = std::abs(log_at(k + span) - log_at(k - span)); d > change)
      change = d, steepest = k;
  if (steepest < 0) return {};

  // Least squares of both levels and the shading for each place of the edge.
  constexpr int kMost = 2 + BlurredEdge::kOrders;
  using Row = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1>;
  using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  const int unknowns = 2 + orders;
  constexpr int kPerStep = static_cast<int>(kStep / BlurredEdge::kFine + 0.5);
  constexpr int kMoves = static_cast<int>(kMove / BlurredEdge::kFine + 0.5);
  std::vector<double> misfits(2 * kMoves + 1);
  for (int move = -kMoves; move <= kMoves; ++move) {
    Normal normal = Normal::Zero(unknowns, unknowns);
    Row right = Row::Zero(unknowns), row(unknowns);
    double squares = 0;
    for (int k = -inside; k <= outside; ++k) {
      const int fine = move - k * kPerStep;
      const double value = profile[steepest + k];
      row[0] = edge.step(fine);
      row[1] = 1 - edge.step(fine);
      for (int order = 0; order < orders; ++order) row[2 + order] = edge.shade(order, fine);
      normal += row * row.transpose();
      right += value * row;
      squares += value * value;
    }
    misfits[move + kMoves] = squares - right.dot(normal.ldlt().solve(right));
  }
  const int best =
      static_cast<int>(std::min_element(misfits.begin(), misfits.end()) - misfits.begin());
  if (best == 0 || best == 2 * kMoves) return {};
  // Together they explain the profile much better than its mean does.
  double mean = 0, spread = 0;
  for (int k = -inside; k <= outside; ++k) mean += profile[steepest + k] / (inside + outside + 1);
  for (int k = -inside; k <= outside; ++k)
    spread += (profile[steepest + k] - mean) * (profile[steepest + k] - mean);
  if (misfits[best] > 0.2 * spread) return {};
  const double below = misfits[best - 1], above = misfits[best + 1],
               bend = below - 2 * misfits[best] + above;
  const double between = bend > 0 ? 0.5 * (below - above) / bend : 0;
  const double seen =
      circle.radius - reach + steepest * kStep + (best - kMoves + between) * BlurredEdge::kFine;
  // Blur along a curved rim moves it inwards.
  const double r = seen + 0.5 * kBlurVariance / circle.radius;
  return {{circle.x + r * c, circle.y + r * s}, true};
}

Circle Moved(Circle circle, const Eigen::Vector3d& by) {
  return {circle.x + by[0], circle.y + by[1], circle.radius + by[2]};
}

// Robust least squares of RimDistance over the points, from `circle` on.
RimFit Fit(const ProbeOptics& optics, Circle circle, const std::vector<RimPoint>& points) {
  std::vector<double> weights(points.size(), 1);
  Eigen::Matrix3d normal;
  double scale = 0;
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<double> residuals(points.size()), sizes;
    for (std::size_t k = 0; k < points.size(); ++k)
      if (points[k].seen) {
        residuals[k] = optics.RimDistance(circle, points[k].p);
        sizes.push_back(std::abs(residuals[k]));
      }
    scale = std::max(1.4826 * MedianOf(sizes), 1e-6);
    normal.setZero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (!points[k].seen) continue;
      const double u = residuals[k] / (kTukey * scale);
      weights[k] = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
      Eigen::Vector3d slope;
      constexpr double kDelta = 1e-3;
      for (int j = 0; j < 3; ++j) {
        const Eigen::Vector3d by = kDelta * Eigen::Vector3d::Unit(j);
        slope[j] = (optics.RimDistance(Moved(circle, by), points[k].p) -
                    optics.RimDistance(Moved(circle, -by), points[k].p)) /
                   (2 * kDelta);
      }
      normal += weights[k] * slope * slope.transpose();
      gradient += weights[k] * residuals[k] * slope;
    }
    const Eigen::Vector3d step = normal.ldlt().solve(gradient);
    circle = Moved(circle, -step);
    if (step.norm() < 1e-7) break;
  }

  RimFit fit;
  fit.circle = circle;
  fit.rays = static_cast<int>(points.size());
  // Variance of the residuals that count, and how far along the rim they depend on each other.
  std::vector<double> left(points.size());
  double sum = 0, total = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].seen || weights[k] == 0) continue;
    left[k] = std::sqrt(weights[k]) * optics.RimDistance(circle, points[k].p);
    sum += left[k] * left[k];
    total += weights[k];
    ++fit.used;
  }
  double correlated = 1;
  for (std::size_t lag = 1; lag < points.size() / 4; ++lag) {
    double product = 0;
    for (std::size_t k = 0; k < left.size(); ++k)
      product += left[k] * left[(k + lag) % left.size()];
    if (product <= 0) break;
    correlated += 2 * product / std::max(sum, 1e-300);
  }
  fit.residual_px = scale;
  const Eigen::Matrix3d covariance =
      (sum / std::max(total - 3, 1.0)) * correlated * normal.inverse();
  fit.sigma = {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)),
               std::sqrt(covariance(2, 2))};
  return fit;
}

// One round: the edges about `circle`, and the circle through them.
RimFit FitOnce(const core::Image& picture, const ProbeOptics& optics, int orders,
               const Circle& circle, double window, const std::string& file) {
  const int rays = std::max(kLeastRays, static_cast<int>(kPi * circle.radius));
  std::vector<RimPoint> points(rays);
  int seen = 0;
  for (int k = 0; k < rays; ++k) {
    points[k] = FindStep(picture, EdgeOf(optics.kind), orders, circle, 2 * kPi * k / rays, window);
    seen += points[k].seen;
  }
  if (4 * seen < rays)
    throw InputError(file,
                     fmt::format("its rim is seen on {} of {} rays about ({:.1f}, {:.1f}), radius "
                                 "{:.1f} pixels",
                                 seen, rays, circle.x, circle.y, circle.radius),
                     "give [rim] centre_px and radius_px, or a picture with a clearer rim");
  return Fit(optics, circle, points);
}

}  // namespace

RimFit FitRim(const core::Image& picture, const ProbeOptics& optics, std::optional<Circle> start,
              const std::string& file) {
  RimFit fit;
  fit.circle = start ? *start : SearchCircle(picture, file);
  // A reduced pixel's error, or that of a hand on a ruler, first.
  const double blocks = double(std::max(picture.width, picture.height)) / kSearchSide;
  const double widest = std::max(4.0, 2 * blocks + 0.02 * fit.circle.radius);
  for (const double window : {widest, 3.0, 2.0, 2.0})
    fit = FitOnce(picture, optics, BlurredEdge::kOrders, fit.circle, window, file);
  // What the last order of the shading still moved stands for those left out.
  const Circle lower =
      FitOnce(picture, optics, BlurredEdge::kOrders - 1, fit.circle, 2.0, file).circle;
  fit.sigma = {std::hypot(fit.sigma.x, fit.circle.x - lower.x),
               std::hypot(fit.sigma.y, fit.circle.y - lower.y),
               std::hypot(fit.sigma.radius, fit.circle.radius - lower.radius)};
  return fit;
}

}  // namespace luxfield::reconstruct
