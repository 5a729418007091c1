#include "luxfield/reconstruct/calibrate/filter/disc_centroids.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;
using rig::RegistrationMark;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Translation to the mean and scale to rms distance sqrt(2).
Matrix3 Normalisation(std::span<const Vec2> points) {
  Vec2 mean;
  for (const Vec2 p : points) mean = mean + (1.0 / static_cast<double>(points.size())) * p;
  double square = 0;
  for (const Vec2 p : points)
    square += (p.x - mean.x) * (p.x - mean.x) + (p.y - mean.y) * (p.y - mean.y);
  const double scale = std::sqrt(2 * static_cast<double>(points.size()) / square);
  Matrix3 t;
  t << scale, 0, -scale * mean.x, 0, scale, -scale * mean.y, 0, 0, 1;
  return t;
}

Vec2 Map(const Matrix3& t, Vec2 p) {
  const Eigen::Vector3d q = t * Eigen::Vector3d(p.x, p.y, 1);
  return {q.x() / q.z(), q.y() / q.z()};
}

}  // namespace

rig::Homography FitHomography(std::span<const Vec2> sensor, std::span<const Vec2> plane) {
  if (sensor.size() != plane.size() || sensor.size() < 4)
    throw InputError("a homography needs 4 marks at least; photograph the whole holder");
  const Matrix3 from = Normalisation(sensor), to = Normalisation(plane);
  // h33 = 1 after scaling: w stays near 1 over the picture. Rows are weighed by 1 / w of the round
  // before, so that residuals are distances on the plane.
  Eigen::Matrix<double, 8, 1> h = Eigen::Matrix<double, 8, 1>::Zero();
  for (int round = 0; round < 3; ++round) {
    Eigen::MatrixXd a(2 * sensor.size(), 8);
    Eigen::VectorXd b(2 * sensor.size());
    for (std::size_t k = 0; k < sensor.size(); ++k) {
      const Vec2 p = Map(from, sensor[k]), q = Map(to, plane[k]);
      const double weight = 1 / (h(6) * p.x + h(7) * p.y + 1);
      const auto row = static_cast<Eigen::Index>(2 * k);
      a.row(row) << p.x, p.y, 1, 0, 0, 0, -q.x * p.x, -q.x * p.y;
      a.row(row + 1) << 0, 0, 0, p.x, p.y, 1, -q.y * p.x, -q.y * p.y;
      b(row) = q.x;
      b(row + 1) = q.y;
      a.middleRows(row, 2) *= weight;
      b.segment(row, 2) *= weight;
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
    if (qr.rank() < 8)
      throw InputError("the marks lie on a line and fix no homography; add marks beside it");
    h = qr.solve(b);
  }
  Matrix3 scaled;
  scaled << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), 1;
  const Matrix3 result = to.inverse() * scaled * from;
  std::array<double, 9> out{};
  std::copy_n(result.data(), 9, out.begin());
  return out;
}

std::vector<std::optional<Vec2>> FindDiscs(const Picture& picture, double half_m,
                                           std::span<const RegistrationMark> marks) {
  std::vector<float> sorted;
  for (const float value : picture.value)
    if (std::isfinite(value)) sorted.push_back(value);
  const char* const remedy = "photograph the whole holder before the light, upright";
  if (sorted.empty()) throw InputError("photograph", "has no known pixel", remedy);
  const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>(0.95 * double(sorted.size()));
  std::nth_element(sorted.begin(), rank, sorted.end());
  const float threshold = *rank / 3;

  cv::Mat bright(picture.height, picture.width, CV_8U);
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column)
      bright.at<unsigned char>(row, column) =
          picture.value[static_cast<std::size_t>(row) * picture.width + column] > threshold;
  cv::Mat labels, statistics, centroids;
  const int components = cv::connectedComponentsWithStats(bright, labels, statistics, centroids);
  int square = 0;
  const auto area = [&](int label) { return statistics.at<int>(label, cv::CC_STAT_AREA); };
  for (int label = 1; label < components; ++label)
    if (square == 0 || area(label) > area(square)) square = label;
  if (square == 0 || area(square) < 400)
    throw InputError("photograph", "shows no bright window of the holder", remedy);

  const auto position = [&](int label) {  // pixel edges are whole numbers
    return Vec2{centroids.at<double>(label, 0) + 0.5, centroids.at<double>(label, 1) + 0.5};
  };
  const Vec2 middle = position(square);
  const double pixels_per_m = std::sqrt(area(square)) / (2 * half_m);
  std::vector<std::optional<Vec2>> found;
  for (const RegistrationMark& mark : marks) {
    const Vec2 expected{middle.x + pixels_per_m * mark.centre_m.x,
                        middle.y - pixels_per_m * mark.centre_m.y};
    const double disc = std::numbers::pi * std::pow(mark.radius_m * pixels_per_m, 2);
    std::optional<Vec2> best;
    double nearest = 0.4 * half_m * pixels_per_m;
    for (int label = 1; label < components; ++label) {
      if (label == square || area(label) < 0.4 * disc || area(label) > 2.5 * disc) continue;
      const Vec2 at = position(label);
      const double distance = std::hypot(at.x - expected.x, at.y - expected.y);
      if (distance >= nearest) continue;
      nearest = distance;
      best = at;
    }
    found.push_back(best);
  }
  return found;
}

Centroid MeasureDisc(const Picture& picture, const rig::Homography& plane_from_sensor,
                     const RegistrationMark& expected) {
  const rig::Homography& h = plane_from_sensor;
  const Vec2 middle = h.Adjugate().Map(expected.centre_m);
  const double pixel_m = std::sqrt(std::abs(h.AreaFactor(middle)));
  const double reach = 2.2 * expected.radius_m / pixel_m + 2;
  struct Sample {
    Vec2 offset;
    double area, value, variance;
    bool around;  // of the dark that is subtracted
  };
  std::vector<Sample> inside;
  double dark = 0, dark_area = 0, all_area = 0;
  const int row0 = std::max(0, static_cast<int>(middle.y - reach)),
            row1 = std::min(picture.height, static_cast<int>(middle.y + reach) + 1),
            column0 = std::max(0, static_cast<int>(middle.x - reach)),
            column1 = std::min(picture.width, static_cast<int>(middle.x + reach) + 1);
  for (int row = row0; row < row1; ++row)
    for (int column = column0; column < column1; ++column) {
      const std::size_t k = static_cast<std::size_t>(row) * picture.width + column;
      const double value = picture.value[k];
      if (!std::isfinite(value)) continue;
      const Vec2 p{column + 0.5, row + 0.5};
      const Vec2 offset = h.Map(p) - expected.centre_m;
      const double distance = std::hypot(offset.x, offset.y) / expected.radius_m;
      if (distance > 2) continue;
      const double area = std::abs(h.AreaFactor(p)), sigma = picture.sigma[k];
      inside.push_back({offset, area, value, sigma * sigma, distance >= 1.6});
      all_area += area;
      if (distance < 1.6) continue;
      dark += area * value;
      dark_area += area;
    }
  if (dark_area > 0) dark /= dark_area;
  double light = 0;
  Vec2 moment;
  for (const Sample& s : inside) {
    const double weight = s.area * (s.value - dark);
    light += weight;
    moment = moment + weight * s.offset;
  }
  if (!(light > 0)) return {expected.centre_m, 0, 0};
  const Vec2 shift = (1 / light) * moment;
  double variance = 0, light_variance = 0;
  for (const Sample& s : inside) {
    const Vec2 d = s.offset - shift;
    variance += 0.5 * (d.x * d.x + d.y * d.y) * s.area * s.area * s.variance;
    const double share = s.area * (s.around ? 1 - all_area / dark_area : 1);
    light_variance += share * share * s.variance;
  }
  const double disc_area = std::numbers::pi * expected.radius_m * expected.radius_m;
  return {expected.centre_m + shift, std::sqrt(variance) / light, light / disc_area,
          std::sqrt(light_variance) / disc_area};
}

}  // namespace luxfield::reconstruct
