#include "luxfield/reconstruct/calibrate/mirror_ball/rim_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_search.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr double kPi = std::numbers::pi;
constexpr double kStep = 0.25;    // of profiles, pixels
constexpr double kTukey = 4.685;  // 95 % efficient on normal residuals (Holland and Welsch 1977)
constexpr int kLeastRays = 64, kLeastSeen = 12;
constexpr int kLeastSide = 64;  // pixels
constexpr double kLeastRadius = 4;
constexpr int kCandidates = 16;
constexpr int kMostRings = 4;
constexpr double kOuterShare = 0.6;  // of how far the best stands out

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

// The rim within +-window of the circle along a direction, with so many orders of shading.
RimPoint FindStep(const core::Image& picture, const BlurredEdge& edge, int orders,
                  const Circle& circle, double angle, double window) {
  const double c = std::cos(angle), s = std::sin(angle);
  constexpr double kInside = 5, kOutside = 3,
                   kMove = 1.25;  // pixels about the steepest place of an edge
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
  // Of edges at least kWeaker times as steep as the steepest the one nearest to the circle: what a
  // ball mirrors has edges next to its rim that are steeper than the rim.
  constexpr double kWeaker = 0.25, kLeast = 0.02;
  const int first = inside, last = count - outside;
  std::vector<double> changes(count);
  for (int k = first; k < last; ++k) changes[k] = std::abs(log_at(k + span) - log_at(k - span));
  const double least =
      std::max(kLeast, kWeaker * *std::max_element(changes.begin(), changes.end()));
  int place = -1;
  for (int k = first; k < last; ++k) {
    const double before = k > first ? changes[k - 1] : 0, after = changes[k + 1];
    if (changes[k] < least || changes[k] < before || changes[k] <= after) continue;
    if (place < 0 || std::abs(k - count / 2) < std::abs(place - count / 2)) place = k;
  }
  if (place < 0) return {};

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
      const double value = profile[place + k];
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
  for (int k = -inside; k <= outside; ++k) mean += profile[place + k] / (inside + outside + 1);
  for (int k = -inside; k <= outside; ++k)
    spread += (profile[place + k] - mean) * (profile[place + k] - mean);
  if (misfits[best] > 0.2 * spread) return {};
  const double below = misfits[best - 1], above = misfits[best + 1],
               bend = below - 2 * misfits[best] + above;
  const double between = bend > 0 ? 0.5 * (below - above) / bend : 0;
  const double seen =
      circle.radius - reach + place * kStep + (best - kMoves + between) * BlurredEdge::kFine;
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
  fit.points = points;
  for (std::size_t k = 0; k < points.size(); ++k) {
    RimPoint& point = fit.points[k];
    point.on_rim =
        point.seen && std::abs(optics.RimDistance(circle, point.p)) <= RimTolerance(circle);
    fit.on_rim += point.on_rim;
  }
  const Eigen::Matrix3d covariance =
      (sum / std::max(total - 3, 1.0)) * correlated * normal.inverse();
  fit.sigma = {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)),
               std::sqrt(covariance(2, 2))};
  return fit;
}

// The edges about `circle` on so many rays.
std::vector<RimPoint> FindSteps(const core::Image& picture, const ProbeOptics& optics, int orders,
                                const Circle& circle, double window, int rays) {
  std::vector<RimPoint> points(rays);
  for (int k = 0; k < rays; ++k)
    points[k] = FindStep(picture, EdgeOf(optics.kind), orders, circle, 2 * kPi * k / rays, window);
  return points;
}

int Seen(const std::vector<RimPoint>& points) {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](const RimPoint& p) { return p.seen; }));
}

// One round: those edges and the circle through them. No circle where they do not settle one.
std::optional<RimFit> FitOnce(const core::Image& picture, const ProbeOptics& optics, int orders,
                              const Circle& circle, double window, int rays) {
  const auto points = FindSteps(picture, optics, orders, circle, window, rays);
  if (Seen(points) < kLeastSeen) return std::nullopt;
  RimFit fit = Fit(optics, circle, points);
  const Circle& found = fit.circle;
  if (!(found.radius > kLeastRadius) || !(std::abs(found.x - circle.x) < circle.radius) ||
      !(std::abs(found.y - circle.y) < circle.radius) || !(found.radius < 2 * circle.radius))
    return std::nullopt;
  return fit;
}

int Rays(const Circle& circle) {
  return std::max(kLeastRays, static_cast<int>(kPi * circle.radius));
}

// From a reduced pixel's error, or that of a hand on a ruler, on; windows narrow from `widest`.
std::optional<RimFit> Refine(const core::Image& picture, const ProbeOptics& optics, Circle circle,
                             std::initializer_list<double> windows) {
  std::optional<RimFit> fit;
  for (const double window : windows) {
    fit = FitOnce(picture, optics, BlurredEdge::kOrders, circle, window, Rays(circle));
    if (!fit) return std::nullopt;
    circle = fit->circle;
  }
  return fit;
}

// How far a hand on a ruler is off.
double WidestWindow(const Circle& circle) { return std::max(4.0, 2 + 0.04 * circle.radius); }

// The outermost of the circles that stand out: what a ball mirrors is squeezed into rings within
// its rim, whose edges can be seen on more of their directions than the rim itself is.
Circle BestCandidate(const core::Image& picture, const EdgeField& edges, const ProbeOptics& optics,
                     const std::string& file) {
  const auto found = SearchCircles(picture, optics, kCandidates);
  if (found.empty())
    throw InputError(file, "shows no circle that stands out", "give [rim] centre_px and radius_px");
  Circle best = found.front().circle;
  const double least = std::max(kLeastStanding, kOuterShare * found.front().evidence.standing);
  for (const auto& [circle, evidence] : found) {
    const double between = std::hypot(circle.x - best.x, circle.y - best.y);
    if (evidence.standing < least || circle.radius <= best.radius ||
        between > circle.radius - best.radius + RimTolerance(circle))
      continue;
    // Where two circles nearly touch, both lie on the same edges.
    if (Evidence(edges, optics, circle, &best).standing >= kOuterShare * least) best = circle;
  }
  for (int growth = 0; growth < kMostRings; ++growth) {
    const auto outer = OuterCircle(edges, optics, best);
    if (!outer) break;
    best = *outer;
  }
  return best;
}

// How far SearchCircles is off.
double SearchError(const core::Image& picture) { return 1 / EvidenceFactor(picture); }

}  // namespace

double RimTolerance(const Circle& circle) { return std::max(1.0, 0.01 * circle.radius); }

RimFit FitRim(const core::Image& picture, const ProbeOptics& optics, std::optional<Circle> start,
              const std::string& file) {
  if (std::min(picture.width, picture.height) < kLeastSide)
    throw InputError(file, fmt::format("{} x {} pixels are too few", picture.width, picture.height),
                     fmt::format("give a picture of at least {} pixels", kLeastSide));
  const EdgeField edges = FindEdges(picture, EvidenceFactor(picture));
  const Circle circle = start ? *start : BestCandidate(picture, edges, optics, file);
  const double widest = start ? WidestWindow(circle) : 2 * SearchError(picture);
  auto fit = Refine(picture, optics, circle, {widest, std::min(widest, 3.0), 2.0, 2.0});
  // What the last order of the shading still moved stands for those left out.
  const auto lower =
      fit ? FitOnce(picture, optics, BlurredEdge::kOrders - 1, fit->circle, 2.0, Rays(fit->circle))
          : std::nullopt;
  if (!lower) {
    const auto points = FindSteps(picture, optics, BlurredEdge::kOrders, circle,
                                  WidestWindow(circle), Rays(circle));
    throw InputError(file,
                     fmt::format("its rim is seen on {} of {} rays about ({:.1f}, {:.1f}), radius "
                                 "{:.1f} pixels",
                                 Seen(points), points.size(), circle.x, circle.y, circle.radius),
                     "give [rim] centre_px and radius_px, or a picture with a clearer rim");
  }
  const Circle &best = fit->circle, &other = lower->circle;
  fit->sigma = {std::hypot(fit->sigma.x, best.x - other.x),
                std::hypot(fit->sigma.y, best.y - other.y),
                std::hypot(fit->sigma.radius, best.radius - other.radius)};
  fit->evidence = Evidence(edges, optics, fit->circle);
  fit->told = start.has_value();
  return *fit;
}

void RequireRim(const RimFit& rim, const std::string& file) {
  if (rim.evidence.standing >= (rim.told ? kLeastStandingTold : kLeastStanding)) return;
  const Circle& circle = rim.circle;
  throw InputError(
      file,
      fmt::format("shows no ball and no lens' circle that can be told from its surroundings: the "
                  "best circle, centre ({:.1f}, {:.1f}), radius {:.1f} pixels, has an edge along "
                  "{:.0f} % of its rim, any circle of that size along {:.0f} %",
                  circle.x, circle.y, circle.radius, 100 * rim.evidence.share,
                  100 * rim.evidence.by_chance),
      rim.told
          ? "correct [rim] centre_px and radius_px (--rim-picture shows what was found there), "
            "or give a picture in which more of the rim stands out"
          : "give its place, [rim] centre_px = [x, y] and radius_px = r (--rim-picture shows "
            "what was found), or a picture in which more of the rim stands out");
}

}  // namespace luxfield::reconstruct
