#include "luxfield/reconstruct/calibrate/response/published_response.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/reconstruct/calibrate/response/response_noise.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kCodes = 256, kNoiseBins = 16;
constexpr double kSaturation = kCodes - 1, kSmoothness = 30;

double Hat(int code) {
  const double x = code / kSaturation;
  return std::max(0.0, std::min(x - 0.01, 0.99 - x)) / 0.49;
}

struct Observation {
  int code;
  double log_t, weight;  // weight: w^2
};

// What one place shows, where at least two exposures count.
std::vector<std::vector<Observation>> CollectObservations(const ResponseSamples& samples,
                                                          std::span<const double> exposures_s) {
  std::vector<std::vector<Observation>> places;
  for (int i = 0; i < samples.count(); ++i) {
    std::vector<Observation> place;
    for (int j = 0; j < samples.exposures; ++j) {
      const std::size_t n = samples.index(i, j);
      const int code = samples.code[n];
      if (const double w = samples.usable[n] ? Hat(code) : 0; w > 0)
        place.push_back({code, std::log(exposures_s[j]), w * w});
    }
    if (place.size() >= 2) places.push_back(std::move(place));
  }
  return places;
}

struct NormalEquations {
  Eigen::MatrixXd data = Eigen::MatrixXd::Zero(kCodes, kCodes);
  Eigen::MatrixXd smoothness = Eigen::MatrixXd::Zero(kCodes, kCodes);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kCodes);
};

NormalEquations Assemble(const std::vector<std::vector<Observation>>& places) {
  NormalEquations normal;
  for (const auto& place : places) {
    double weights = 0, mean_log_t = 0;
    for (const Observation& o : place) {
      weights += o.weight;
      mean_log_t += o.weight * o.log_t;
    }
    mean_log_t /= weights;
    for (const Observation& o : place) {
      normal.data(o.code, o.code) += o.weight;
      normal.right[o.code] += o.weight * (o.log_t - mean_log_t);
      for (const Observation& other : place)
        normal.data(o.code, other.code) -= o.weight * other.weight / weights;
    }
  }
  constexpr double kSecondDifference[] = {1, -2, 1};
  for (int z = 1; z + 1 < kCodes; ++z) {
    const double weight = std::pow(kSmoothness * Hat(z), 2);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        normal.smoothness(z - 1 + a, z - 1 + b) +=
            weight * kSecondDifference[a] * kSecondDifference[b];
  }
  return normal;
}

double LogRadiance(const std::vector<Observation>& place, const Eigen::VectorXd& g) {
  double weights = 0, sum = 0;
  for (const Observation& o : place) {
    weights += o.weight;
    sum += o.weight * (g[o.code] - o.log_t);
  }
  return sum / weights;
}

}  // namespace

FittedResponse FitPublishedResponse(const ResponseSamples& samples,
                                    std::span<const double> exposures_s, double reference_code,
                                    const std::string& what) {
  const auto places = CollectObservations(samples, exposures_s);
  if (places.size() < kLeastResponseSamples) throw TooFewResponseSamples(what, places.size());

  // Solve for the codes that the equations reach, the reference's g held at 0.
  const NormalEquations normal = Assemble(places);
  const auto reference = static_cast<int>(reference_code);
  std::vector<int> free;
  for (int z = 0; z < kCodes; ++z)
    if (z != reference && normal.smoothness(z, z) > 0) free.push_back(z);
  const Eigen::MatrixXd data = normal.data(free, free);
  const Eigen::LDLT<Eigen::MatrixXd> factors(data + normal.smoothness(free, free));
  Eigen::VectorXd g = Eigen::VectorXd::Zero(kCodes), sigma = Eigen::VectorXd::Zero(kCodes);
  const Eigen::VectorXd right = normal.right(free), solution = factors.solve(right);
  g(free) = solution;
  const Eigen::MatrixXd covariance =
      factors.solve(Eigen::MatrixXd::Identity(data.rows(), data.cols()));
  sigma(free) = covariance.diagonal().cwiseMax(0).cwiseSqrt();

  FittedResponse result;
  result.samples = static_cast<int>(places.size());
  result.degrees = -covariance.cwiseProduct(data).sum();
  int low = kCodes, high = 0;
  for (const auto& place : places) {
    const double log_x = LogRadiance(place, g);
    result.degrees += static_cast<double>(place.size()) - 1;
    for (const Observation& o : place) {
      result.chi_squared += o.weight * std::pow(g[o.code] - log_x - o.log_t, 2);
      low = std::min(low, o.code);
      high = std::max(high, o.code);
    }
  }
  sigma *= std::sqrt(result.chi_squared / std::max(result.degrees, 1.0));

  // Keep the codes with data about the reference on which g rises.
  int first = reference, last = reference;
  while (first > low && g[first] > g[first - 1]) --first;
  while (last < high && g[last + 1] > g[last]) ++last;
  result.curve.saturation_code = kSaturation;
  result.curve.reference_code = reference_code;
  for (int z = first; z <= last; ++z) {
    result.curve.code.push_back(z);
    result.curve.log_exposure.push_back(g[z]);
    result.curve.sigma.push_back(sigma[z]);
  }
  if (result.curve.code.size() < 3) throw NoRisingCurve(what, reference_code);

  std::vector<ExposureResidual> residuals;
  for (const auto& place : places) {
    const double log_x = LogRadiance(place, g);
    double weights = 0;
    for (const Observation& o : place) weights += o.weight;
    for (const Observation& o : place)
      residuals.push_back(
          {result.curve.Code(log_x + o.log_t), g[o.code] - log_x - o.log_t, o.weight / weights});
  }
  ExposureNoise noise = EstimateExposureNoise(std::move(residuals), kSaturation, kNoiseBins);
  if (noise.code.empty()) throw NoRisingCurve(what, reference_code);
  result.curve.noise_code = std::move(noise.code);
  result.curve.noise = std::move(noise.sigma);
  return result;
}

}  // namespace luxfield::reconstruct
