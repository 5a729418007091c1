#include "luxfield/reconstruct/calibrate/geometry/chessboard_corners.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "luxfield/core/parallel.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr int kParameters = 10;  // x0, y0, angles of n1 and n2, m, c, w1, w2, g_x, g_y
constexpr double kLargestRadius_px = 7, kSmallestRadius_px = 3.5;
constexpr double kEdge_px = 3.5;  // half of what a blurred edge of the next cell covers
constexpr int kIterations = 30;

using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Normal = Eigen::Matrix<double, kParameters, kParameters>;

struct Sample {
  double x, y, signal;
};

// Model and its gradient at one pixel centre.
double Model(const Parameters& p, double x, double y, Parameters& gradient) {
  const double dx = x - p[0], dy = y - p[1];
  const double c1 = std::cos(p[2]), s1 = std::sin(p[2]), c2 = std::cos(p[3]), s2 = std::sin(p[3]);
  const double d1 = c1 * dx + s1 * dy, d2 = c2 * dx + s2 * dy;
  constexpr double kRoot = std::numbers::sqrt2;
  const double t1 = d1 / (kRoot * p[6]), t2 = d2 / (kRoot * p[7]);
  const double e1 = std::erf(t1), e2 = std::erf(t2);
  constexpr double kTwoOverRootPi = 2 * std::numbers::inv_sqrtpi;
  const double slope1 = kTwoOverRootPi * std::exp(-t1 * t1),
               slope2 = kTwoOverRootPi * std::exp(-t2 * t2);
  const double shade = 1 + p[8] * dx + p[9] * dy, pattern = p[4] + p[5] * e1 * e2;
  const double by_d1 = shade * p[5] * e2 * slope1 / (kRoot * p[6]),
               by_d2 = shade * p[5] * e1 * slope2 / (kRoot * p[7]);
  gradient[0] = -by_d1 * c1 - by_d2 * c2 - pattern * p[8];
  gradient[1] = -by_d1 * s1 - by_d2 * s2 - pattern * p[9];
  gradient[2] = by_d1 * (-s1 * dx + c1 * dy);
  gradient[3] = by_d2 * (-s2 * dx + c2 * dy);
  gradient[4] = shade;
  gradient[5] = shade * e1 * e2;
  gradient[6] = -by_d1 * d1 / p[6];
  gradient[7] = -by_d2 * d2 / p[7];
  gradient[8] = pattern * dx;
  gradient[9] = pattern * dy;
  return shade * pattern;
}

struct Step {
  double cost = 0;  // sum of squared residuals in standard deviations, at the start
  Normal normal = Normal::Zero();
  Parameters right = Parameters::Zero();
};

Step Linearise(const SignalImage& image, const std::vector<Sample>& samples, const Parameters& p) {
  Step step;
  Parameters gradient;
  for (const Sample& s : samples) {
    const double model = Model(p, s.x, s.y, gradient), off = s.signal - model;
    const double weight = 1 / image.Variance(model);
    step.cost += weight * off * off;
    step.normal.noalias() += weight * gradient * gradient.transpose();
    step.right += weight * off * gradient;
  }
  return step;
}

Vec2 Straight(const rig::Lens* lens, Vec2 p) { return lens ? lens->Straight(p) : p; }
Vec2 Bent(const rig::Lens* lens, Vec2 p) { return lens ? lens->Bent(p) : p; }

// The pixels whose centres lie in a disc, at their straightened positions; empty if it leaves the
// image.
std::vector<Sample> Disc(const SignalImage& image, Vec2 centre, double radius,
                         const rig::Lens* lens) {
  std::vector<Sample> samples;
  if (centre.x < radius || centre.y < radius || centre.x > image.width - radius ||
      centre.y > image.height - radius)
    return samples;
  for (int row = static_cast<int>(centre.y - radius); row <= centre.y + radius; ++row)
    for (int column = static_cast<int>(centre.x - radius); column <= centre.x + radius; ++column) {
      if (row < 0 || column < 0 || row >= image.height || column >= image.width) continue;
      const double x = column + 0.5, y = row + 0.5;
      const std::size_t k = static_cast<std::size_t>(row) * image.width + column;
      if (!image.usable[k] || std::hypot(x - centre.x, y - centre.y) > radius) continue;
      const Vec2 at = Straight(lens, {x, y});
      samples.push_back({at.x, at.y, image.signal_dn[k]});
    }
  return samples;
}

// Levenberg-Marquardt from `p`; false if it runs away.
bool Fit(const SignalImage& image, const std::vector<Sample>& samples, Parameters& p) {
  double damping = 1e-3;
  Step step = Linearise(image, samples, p);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Normal damped = step.normal;
    damped.diagonal() *= 1 + damping;
    const Parameters move = damped.ldlt().solve(step.right);
    if (!move.allFinite()) return false;
    Parameters next = p + move;
    for (const int width : {6, 7}) next[width] = std::clamp(next[width], 0.2, 4.0);
    const Step there = Linearise(image, samples, next);
    if (!(there.cost <= step.cost * (1 + 1e-9))) {
      damping *= 10;
      if (damping > 1e8) return false;
      continue;
    }
    damping = std::max(1e-12, damping / 10);
    p = next;
    step = there;
    if (std::abs(move[0]) + std::abs(move[1]) < 1e-6) return true;
  }
  return false;
}

double Cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }

cv::Mat EightBit(const SignalImage& image) {
  std::vector<float> sorted(image.signal_dn);
  const auto at = [&](double share) {
    const auto k = sorted.begin() +
                   static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), k, sorted.end());
    return *k;
  };
  const float low = at(0.01), high = at(0.99), scale = 255 / std::max(high - low, 1e-6f);
  cv::Mat grey(image.height, image.width, CV_8UC1);
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      grey.at<unsigned char>(row, column) = cv::saturate_cast<unsigned char>(
          scale * (image.signal_dn[static_cast<std::size_t>(row) * image.width + column] - low));
  return grey;
}

// Mean over the cells of (-1)^(i + j) times what their middles show.
double Parity(const SignalImage& image, const std::vector<Vec2>& corners, int columns, int rows) {
  double sum = 0;
  for (int j = 0; j + 1 < rows; ++j)
    for (int i = 0; i + 1 < columns; ++i) {
      const Vec2* p = &corners[static_cast<std::size_t>(j) * columns + i];
      const Vec2 middle = 0.25 * (p[0] + p[1] + p[columns] + p[columns + 1]);
      const int column = std::clamp(static_cast<int>(middle.x), 0, image.width - 1),
                row = std::clamp(static_cast<int>(middle.y), 0, image.height - 1);
      const double signal = image.signal_dn[static_cast<std::size_t>(row) * image.width + column];
      sum += (i + j) % 2 == 0 ? signal : -signal;
    }
  return sum;
}

std::vector<Corner> Refine(const SignalImage& image, const std::vector<Corner>& corners,
                           const rig::Lens* lens) {
  std::map<std::pair<int, int>, Vec2> places;
  for (const Corner& corner : corners) places[{corner.i, corner.j}] = corner.at;
  // The step to the next corner, or from the one before.
  const auto step = [&](const Corner& corner, int di, int dj) -> std::optional<Vec2> {
    for (const int sign : {1, -1}) {
      const auto next = places.find({corner.i + sign * di, corner.j + sign * dj});
      if (next != places.end()) return sign * (next->second - corner.at);
    }
    return {};
  };
  std::vector<std::optional<Corner>> refined(corners.size());
  core::ParallelFor(corners.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Corner& corner = corners[k];
      const auto step_i = step(corner, 1, 0), step_j = step(corner, 0, 1);
      if (!step_i || !step_j) continue;
      refined[k] = RefineCorner(image, corner.at, *step_i, *step_j, lens);
      if (refined[k]) refined[k]->i = corner.i, refined[k]->j = corner.j;
    }
  });
  std::vector<Corner> result;
  for (const auto& corner : refined)
    if (corner) result.push_back(*corner);
  return result;
}

void KeepGreen(const std::string& cfa, SignalImage& image) {
  const std::vector<float> seen = image.signal_dn;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      if (rig::CfaChannel(cfa, row, column) == 1) continue;
      float sum = 0;
      int greens = 0;
      for (const auto& [down, right] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const int r = row + down, c = column + right;
        if (r < 0 || c < 0 || r >= image.height || c >= image.width) continue;
        sum += seen[static_cast<std::size_t>(r) * image.width + c];
        ++greens;
      }
      const std::size_t k = static_cast<std::size_t>(row) * image.width + column;
      image.signal_dn[k] = sum / static_cast<float>(greens);
      image.usable[k] = 0;
    }
}

}  // namespace

double SignalImage::Variance(double signal) const {
  const double light = std::max(signal, 0.0);
  return floor_variance_dn2 + gain_dn_per_e * light + prnu * light * prnu * light;
}

SignalImage MakeSignalImage(const session::RawFrame& frame, const rig::SensorModel& sensor) {
  SignalImage image{
      frame.width,
      frame.height,
      std::vector<float>(frame.size()),
      std::vector<char>(frame.size(), 1),
      sensor.gain_dn_per_e,
      sensor.read_noise_dn * sensor.read_noise_dn + sensor.quantisation_variance_dn2(),
      sensor.prnu};
  for (std::size_t k = 0; k < frame.size(); ++k) {
    image.signal_dn[k] = static_cast<float>(frame.at(k) - sensor.black_dn);
    image.usable[k] = frame.at(k) < sensor.saturation_dn;
  }
  for (const auto& [row, column] : sensor.defects)
    image.usable[static_cast<std::size_t>(row) * frame.width + column] = 0;
  if (!sensor.cfa.empty()) KeepGreen(sensor.cfa, image);
  return image;
}

std::optional<Corner> RefineCorner(const SignalImage& image, Vec2 start, Vec2 step_i, Vec2 step_j,
                                   const rig::Lens* lens) {
  // Edge 1 runs along step_j, edge 2 along step_i; their normals point to growing i and j.
  const double area = std::abs(Cross(step_i, step_j));
  const double reach =
      std::min(area / std::hypot(step_i.x, step_i.y), area / std::hypot(step_j.x, step_j.y));
  const double radius = std::min(kLargestRadius_px, reach - kEdge_px);
  if (radius < kSmallestRadius_px) return {};
  const auto normal = [](Vec2 along, Vec2 towards) {
    const Vec2 n = Cross(along, towards) > 0 ? Vec2{-along.y, along.x} : Vec2{along.y, -along.x};
    return std::atan2(n.y, n.x);
  };
  Parameters p;
  const Vec2 straight = Straight(lens, start);
  p << straight.x, straight.y, normal(step_j, step_i), normal(step_i, step_j), 0, 0, 0.8, 0.8, 0, 0;
  std::vector<Sample> samples;
  // Once about the start, once about what was found: the disc has to lie evenly about the corner.
  for (int pass = 0; pass < 2; ++pass) {
    samples = Disc(image, Bent(lens, {p[0], p[1]}), radius, lens);
    if (samples.size() < 2 * kParameters) return {};
    if (pass == 0) {
      // Levels from the signs of the four quadrants.
      double sum = 0, signs = 0;
      for (const Sample& s : samples) {
        const Vec2 d{s.x - p[0], s.y - p[1]};
        const double one = std::cos(p[2]) * d.x + std::sin(p[2]) * d.y,
                     two = std::cos(p[3]) * d.x + std::sin(p[3]) * d.y;
        sum += s.signal;
        signs += one * two > 0 ? s.signal : -s.signal;
      }
      p[4] = sum / static_cast<double>(samples.size());
      p[5] = signs / static_cast<double>(samples.size());
    }
    const Vec2 before{p[0], p[1]};
    if (!Fit(image, samples, p)) return {};
    if (std::hypot(p[0] - before.x, p[1] - before.y) > (pass == 0 ? 0.5 * radius : 1.0)) return {};
  }
  const Step at = Linearise(image, samples, p);
  const Normal covariance = at.normal.ldlt().solve(Normal::Identity());
  if (!covariance.allFinite()) return {};
  Corner corner;
  corner.at = Bent(lens, {p[0], p[1]});
  // The covariance bends with the position.
  Eigen::Matrix2d jacobian;
  const Vec2 by_x = Bent(lens, {p[0] + 0.5, p[1]}) - Bent(lens, {p[0] - 0.5, p[1]}),
             by_y = Bent(lens, {p[0], p[1] + 0.5}) - Bent(lens, {p[0], p[1] - 0.5});
  jacobian << by_x.x, by_y.x, by_x.y, by_y.y;
  const Eigen::Matrix2d bent = jacobian * covariance.topLeftCorner<2, 2>() * jacobian.transpose();
  corner.variance_x_px2 = bent(0, 0);
  corner.variance_y_px2 = bent(1, 1);
  corner.covariance_px2 = bent(0, 1);
  // A corner that is not there would be placed to no better than its disc.
  if (!(corner.variance_x_px2 > 0 && corner.variance_y_px2 > 0 &&
        corner.variance_x_px2 + corner.variance_y_px2 < 0.25))
    return {};
  return corner;
}

std::vector<Corner> FindChessboard(const SignalImage& image, const rig::Chessboard& chessboard,
                                   bool mirrored) {
  const int columns = chessboard.columns, rows = chessboard.rows;
  const cv::Mat grey = EightBit(image);
  std::vector<cv::Point2f> found;
  if (!cv::findChessboardCorners(grey, {columns, rows}, found,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE) &&
      !cv::findChessboardCornersSB(grey, {columns, rows}, found))
    return {};
  std::vector<Vec2> corners;
  for (const cv::Point2f& p : found) corners.push_back({p.x + 0.5, p.y + 0.5});
  const auto at = [&](int i, int j) { return corners[static_cast<std::size_t>(j) * columns + i]; };
  const int middle_i = columns / 2, middle_j = rows / 2;
  const double hand = Cross(at(middle_i, middle_j) - at(middle_i - 1, middle_j),
                            at(middle_i, middle_j) - at(middle_i, middle_j - 1));
  if ((hand < 0) != mirrored)
    for (int j = 0; j < rows; ++j)
      std::reverse(corners.begin() + j * columns, corners.begin() + (j + 1) * columns);
  if (Parity(image, corners, columns, rows) < 0) std::reverse(corners.begin(), corners.end());

  std::vector<Corner> rough(corners.size());
  for (std::size_t k = 0; k < corners.size(); ++k)
    rough[k] = {static_cast<int>(k) % columns, static_cast<int>(k) / columns, corners[k], 0, 0, 0};
  return Refine(image, rough, nullptr);
}

std::vector<Corner> RefineCorners(const SignalImage& image, const std::vector<Corner>& corners,
                                  const rig::Lens& lens) {
  return Refine(image, corners, &lens);
}

}  // namespace luxfield::reconstruct
