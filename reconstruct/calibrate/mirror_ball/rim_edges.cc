#include "luxfield/reconstruct/calibrate/mirror_ball/rim_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

constexpr double kBlur = 0.6;         // pixels
constexpr double kTolerance = 0.6;    // pixels from the circle
constexpr double kStep = 0.2;         // of profiles, pixels
constexpr double kAlong = 0.98;       // cosine of the angle between slope and radius
constexpr double kLeastSlope = 0.03;  // of ln radiance per pixel
constexpr double kBesides = 2;        // pixels
constexpr int kLeastDirections = 64;
constexpr int kChanceCircles = 200;

lightfield::Vec2 SlopeAt(const core::Image& slope, double x, double y) {
  const double u = std::clamp(x - 0.5, 0.0, slope.width - 1.0),
               v = std::clamp(y - 0.5, 0.0, slope.height - 1.0);
  const int column = std::min(static_cast<int>(u), slope.width - 2),
            row = std::min(static_cast<int>(v), slope.height - 2);
  const double a = u - column, b = v - row;
  const auto at = [&](int channel) {
    const auto line = slope.plane(channel).data() + std::size_t(row) * slope.width + column;
    return (1 - b) * ((1 - a) * line[0] + a * line[1]) +
           b * ((1 - a) * line[slope.width] + a * line[slope.width + 1]);
  };
  return {at(0), at(1)};
}

// Whether an edge crosses the direction (c, s) at the distance r from (x, y), and runs square to
// it. Reduced pixels.
bool EdgeAt(const core::Image& slope, double x, double y, double r, double c, double s) {
  constexpr int kSteps = static_cast<int>(kTolerance / kStep + 0.5);
  const double reach = kTolerance + kStep;
  const auto inside = [&](double d) {
    const double u = x + d * c, v = y + d * s;
    return u > 1 && v > 1 && u < slope.width - 1 && v < slope.height - 1;
  };
  if (!inside(r + reach) || !inside(r - reach)) return false;
  std::array<double, 2 * kSteps + 3> steepness;  // squared
  std::array<bool, 2 * kSteps + 3> along;
  for (int k = -kSteps - 1; k <= kSteps + 1; ++k) {
    const double d = r + k * kStep;
    const auto g = SlopeAt(slope, x + d * c, y + d * s);
    const double square = g.x * g.x + g.y * g.y, radial = g.x * c + g.y * s;
    steepness[k + kSteps + 1] = square;
    along[k + kSteps + 1] =
        square > kLeastSlope * kLeastSlope && radial * radial > kAlong * kAlong * square;
  }
  for (std::size_t k = 1; k + 1 < along.size(); ++k)
    if (along[k] && steepness[k] >= steepness[k - 1] && steepness[k] >= steepness[k + 1])
      return true;
  return false;
}

// Means over areas; the factor need not be one over a whole number.
core::Image Reduced(const core::Image& picture, double factor) {
  core::Image small(static_cast<int>(picture.width * factor),
                    static_cast<int>(picture.height * factor), 1);
  const cv::Mat from(picture.height, picture.width, CV_32F,
                     const_cast<float*>(picture.data.data()));
  cv::Mat to(small.height, small.width, CV_32F, small.data.data());
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

double EvidenceFactor(const core::Image& picture) {
  return std::min(1.0, double(kEvidenceSide) / std::max(picture.width, picture.height));
}

EdgeField FindEdges(const core::Image& original, double factor) {
  const core::Image picture = factor < 1 ? Reduced(original, factor) : original;
  std::vector<float> values = picture.data;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double floor = std::max(1e-3 * *middle, 1e-30);
  cv::Mat logarithm(picture.height, picture.width, CV_32F);
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column)
      logarithm.at<float>(row, column) =
          static_cast<float>(std::log(std::max(0.0f, picture.at(0, row, column)) + floor));
  cv::GaussianBlur(logarithm, logarithm, {}, kBlur, kBlur, cv::BORDER_REPLICATE);
  EdgeField edges{core::Image(picture.width, picture.height, 2), factor};
  for (int row = 1; row + 1 < picture.height; ++row)
    for (int column = 1; column + 1 < picture.width; ++column) {
      edges.slope.at(0, row, column) =
          0.5f * (logarithm.at<float>(row, column + 1) - logarithm.at<float>(row, column - 1));
      edges.slope.at(1, row, column) =
          0.5f * (logarithm.at<float>(row + 1, column) - logarithm.at<float>(row - 1, column));
    }
  return edges;
}

double ShareOnEdge(const EdgeField& edges, const ProbeOptics& optics, const Circle& circle,
                   double apart, const Circle* besides) {
  const auto counts = [&](double x, double y) {
    return !besides || std::abs(std::hypot(x - besides->x, y - besides->y) - besides->radius) >
                           kBesides / edges.factor;
  };
  const double factor = edges.factor;
  const int directions = std::max(
      kLeastDirections, static_cast<int>(2 * std::numbers::pi * factor * circle.radius / apart));
  int on = 0;
  for (int k = 0; k < directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / directions, c = std::cos(angle),
                 s = std::sin(angle);
    // Where perspective makes an ellipse of the rim, it is a few pixels off the circle.
    const double off =
        optics.RimDistance(circle, {circle.x + circle.radius * c, circle.y + circle.radius * s});
    const double r = circle.radius - off;
    on += counts(circle.x + r * c, circle.y + r * s) &&
          EdgeAt(edges.slope, factor * circle.x, factor * circle.y, factor * r, c, s);
  }
  return double(on) / directions;
}

RimEvidence Evidence(const EdgeField& edges, const ProbeOptics& optics, const Circle& circle,
                     const Circle* besides) {
  RimEvidence evidence;
  evidence.share = ShareOnEdge(edges, optics, circle, 1, besides);
  core::Random random(1, 0, 0);
  // Of circles about as large as the picture, places within a radius of its middle.
  const double picture_width = edges.slope.width / edges.factor,
               picture_height = edges.slope.height / edges.factor,
               width = std::max(picture_width - 2 * circle.radius, circle.radius),
               height = std::max(picture_height - 2 * circle.radius, circle.radius);
  double sum = 0, squares = 0;
  for (int k = 0; k < kChanceCircles; ++k) {
    const double x = 0.5 * picture_width + width * (random.Uniform() - 0.5),
                 y = 0.5 * picture_height + height * (random.Uniform() - 0.5);
    const double share = ShareOnEdge(edges, {}, {x, y, circle.radius});
    sum += share;
    squares += share * share;
  }
  evidence.by_chance = sum / kChanceCircles;
  const double variance = squares / kChanceCircles - evidence.by_chance * evidence.by_chance;
  // Where the surroundings are black no circle has an edge: one direction is the least step.
  const double least = 1 / (2 * std::numbers::pi * edges.factor * circle.radius);
  evidence.standing = (evidence.share - evidence.by_chance) / std::sqrt(variance + least * least);
  return evidence;
}

}  // namespace luxfield::reconstruct
