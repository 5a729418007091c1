#include "luxfield/reconstruct/calibrate/response/fit_response.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "luxfield/reconstruct/calibrate/response/joint_response.h"
#include "luxfield/reconstruct/calibrate/response/published_response.h"
#include "luxfield/reconstruct/calibrate/response/response_noise.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kNodes = 512;  // of the curve that is returned; linear in ln z between them to 1e-4
constexpr int kNoiseBins = 16, kRounds = 7, kPasses = 12;
constexpr double kSettled = 0.03;       // of a standard error
constexpr double kHighestShare = 0.97;  // of saturation, for predicted codes,
constexpr double kMarginShare = 0.985;  // and with kMarginSigmas of noise
constexpr double kMarginSigmas = 4;
constexpr double kLargestNoise = 0.15;  // relative
constexpr double kFirstSmoothness = 0.3, kLeastSmoothness = 0.03, kMostSmoothness = 3;
constexpr double kHardlySmooth = 1;

class Fit {
 public:
  Fit(const ResponseSamples& samples, std::span<const double> exposures_s, double saturation_code,
      double reference_code, const FitResponseOptions& options, const std::string& what)
      : joint_(samples, exposures_s, reference_code, options.huber_sigmas),
        options_(options),
        what_(what),
        spline_(saturation_code) {
    curve_.saturation_code = saturation_code;
    curve_.reference_code = reference_code;
    curve_.code = CurveNodes(saturation_code, reference_code, kNodes);
    curve_.log_exposure.resize(curve_.code.size());
  }

  // Curve, weights and noise of kDebevecMalik.
  FittedResponse Smooth() {
    StartWeights();
    joint_.StartRadiances(spline_);
    double smoothness = kFirstSmoothness;
    for (int round = 0; round < kRounds; ++round) {
      if (!joint_.Step(spline_, ResponseLikelihood::kLog, smoothness)) throw NoSolution(what_);
      Tabulate(spline_);
      const CurveInformation information = joint_.Information(spline_, smoothness);
      Reweigh(spline_);
      if (round > 0) smoothness = EvidentSmoothness(spline_, information, smoothness);
    }
    return Settled(spline_, ResponseLikelihood::kLog, smoothness);
  }

  // After Smooth().
  FittedResponse Robertson() {
    return Settled(spline_, ResponseLikelihood::kExposure, kHardlySmooth);
  }

  // After Smooth(), whose result is `start`.
  FittedResponse Polynomial(const ResponseCurve& start) const {
    std::optional<FittedResponse> best;
    double best_bic = 0;
    // Two orders in a row that gain nothing end the search: even and odd ones differ.
    for (int order = 1, idle = 0; order <= options_.max_order && idle < 2; ++order) {
      PolynomialResponse polynomial(order, start);
      Fit trial = *this;
      auto fit = trial.Settle(polynomial, ResponseLikelihood::kExposure, 0);
      if (!fit || fit->curve.low_code() > start.low_code() ||
          fit->curve.high_code() < start.high_code())
        continue;
      fit->order = order;
      const double codes = fit->degrees + fit->samples + order,
                   bic = fit->chi_squared + order * std::log(codes);
      ++idle;
      if (best && bic >= best_bic) continue;
      best_bic = bic;
      best = std::move(fit);
      idle = 0;
    }
    if (!best) throw NoRisingCurve(what_, curve_.reference_code);
    return *best;
  }

 private:
  // As if codes had noise of 1/256 of the scale, and g a slope of 2.
  void StartWeights() {
    for (CodeObservation& o : joint_.observations) {
      const double share = o.code / curve_.saturation_code;
      o.weight = share > 0.02 && share < kHighestShare ? 128 * share : 0.0;
      o.predicted_code = o.code;
    }
    KeepPairs();
  }

  void KeepPairs() {
    const int left = joint_.KeepPairs();
    if (left < kLeastResponseSamples) throw TooFewResponseSamples(what_, left);
  }

  // The model at the nodes; stretches that fall are level, so that it has an inverse.
  void Tabulate(const ResponseModel& model) {
    std::vector<double>& g = curve_.log_exposure;
    for (std::size_t k = 0; k < g.size(); ++k) {
      g[k] = model.LogExposure(curve_.code[k]);
      if (k > 0) g[k] = std::max(g[k], g[k - 1] + 1e-9);
    }
  }

  double Code(double log_exposure) const {
    return std::clamp(curve_.Code(log_exposure), 0.5, curve_.saturation_code - 0.5);
  }

  void Predict() {
    for (CodeObservation& o : joint_.observations) o.predicted_code = Code(joint_.log_exposure(o));
  }

  // Noise, weights and the choice of codes by the curve in the table.
  void Reweigh(const ResponseModel& model) {
    Predict();
    std::vector<ExposureResidual> residuals;
    for (const CodeObservation& o : joint_.observations)
      if (o.weight > 0)
        residuals.push_back(
            {o.predicted_code,
             (std::exp(model.LogExposure(o.code) - joint_.log_exposure(o)) - 1) / LastNoise(o),
             o.leverage});
    ExposureNoise noise =
        EstimateExposureNoise(std::move(residuals), curve_.saturation_code, kNoiseBins);
    if (noise.code.empty()) throw NoRisingCurve(what_, curve_.reference_code);
    for (std::size_t k = 0; k < noise.code.size(); ++k)
      if (!curve_.noise.empty()) noise.sigma[k] *= curve_.Noise(noise.code[k]);
    curve_.noise_code = std::move(noise.code);
    curve_.noise = std::move(noise.sigma);
    for (CodeObservation& o : joint_.observations) {
      const double sigma = std::max(LastNoise(o), Rounding(o.predicted_code)),
                   highest = Code(joint_.log_exposure(o) + kMarginSigmas * sigma);
      const bool counts = sigma <= kLargestNoise &&
                          o.predicted_code < kHighestShare * curve_.saturation_code &&
                          highest < kMarginShare * curve_.saturation_code;
      o.weight = counts ? 1 / sigma : 0.0;
      o.log_bias = counts ? sigma * sigma / 2 : 0.0;
    }
    KeepPairs();
  }

  double LastNoise(const CodeObservation& o) const {
    return curve_.noise.empty() ? 1.0 : curve_.Noise(o.predicted_code);
  }

  // Relative standard deviation of the exposure from rounding the code: the least that noise is.
  double Rounding(double z) const {
    const double half = std::min(0.5, z / 2);
    return (curve_.LogExposure(z + half) - curve_.LogExposure(z - half)) / (2 * half) /
           std::sqrt(12.0);
  }

  static double EvidentSmoothness(const ResponseModel& model, const CurveInformation& information,
                                  double smoothness) {
    const Eigen::MatrixXd rows = model.RoughnessRows();
    const double roughness = (rows * model.parameters).squaredNorm();
    // Parameters that smoothness decides: all but a line's two, less those of the data.
    const double decided = (rows * information.covariance * rows.transpose()).trace() /
                           (smoothness * smoothness),
                 from_data = static_cast<double>(model.parameters.size()) - 2 - decided;
    return std::clamp(std::sqrt(roughness / std::max(from_data, 0.5)), kLeastSmoothness,
                      kMostSmoothness);
  }

  FittedResponse Settled(ResponseModel& model, ResponseLikelihood likelihood, double smoothness) {
    auto result = Settle(model, likelihood, smoothness);
    if (!result) throw NoSolution(what_);
    return *std::move(result);
  }

  // Steps with weights and choice as they are, then the result; none: the least squares have no
  // solution.
  std::optional<FittedResponse> Settle(ResponseModel& model, ResponseLikelihood likelihood,
                                       double smoothness) {
    CurveInformation information;
    for (int pass = 0; pass < kPasses; ++pass) {
      Predict();
      const std::vector<double> before = curve_.log_exposure;
      if (!joint_.Step(model, likelihood, smoothness)) return std::nullopt;
      Tabulate(model);
      information = joint_.Information(model, smoothness);
      SetSigma(model, information);
      if (pass > 0 && LargestChange(before) < kSettled) break;
    }
    FittedResponse result;
    result.chi_squared = information.chi_squared;
    result.degrees = information.degrees;
    result.samples = joint_.KeepPairs();
    result.curve = Calibrated(model);
    return result;
  }

  void SetSigma(const ResponseModel& model, const CurveInformation& information) {
    const double excess =
        std::max(1.0, information.chi_squared / std::max(information.degrees, 1.0));
    const Eigen::VectorXd reference = model.Derivative(curve_.reference_code);
    curve_.sigma.clear();
    for (const double z : curve_.code) {
      const Eigen::VectorXd row = model.Derivative(z) - reference;
      curve_.sigma.push_back(
          std::sqrt(std::max(0.0, excess * row.dot(information.covariance * row))));
    }
  }

  // Of the nodes that are kept, in standard errors.
  double LargestChange(const std::vector<double>& before) const {
    const auto [low, high] = CodeRange();
    double change = 0;
    for (std::size_t k = 0; k < before.size(); ++k)
      if (curve_.code[k] >= low && curve_.code[k] <= high && curve_.sigma[k] > 0)
        change = std::max(change, std::abs(curve_.log_exposure[k] - before[k]) / curve_.sigma[k]);
    return change;
  }

  // Codes that count, less a hundredth at either end, which settles nothing.
  std::pair<double, double> CodeRange() const {
    std::vector<double> codes;
    for (const CodeObservation& o : joint_.observations)
      if (o.weight > 0) codes.push_back(o.code);
    std::sort(codes.begin(), codes.end());
    return {codes[codes.size() / 100], codes[codes.size() - 1 - codes.size() / 100]};
  }

  // The nodes about the reference on which g rises.
  ResponseCurve Calibrated(const ResponseModel& model) const {
    const auto [low, high] = CodeRange();
    const auto& code = curve_.code;
    const auto reference =
        static_cast<int>(std::find(code.begin(), code.end(), curve_.reference_code) - code.begin());
    std::vector<double> g;
    for (const double z : code) g.push_back(model.LogExposure(z));
    int first = reference, last = reference;
    while (first > 0 && code[first - 1] >= low && g[first] > g[first - 1]) --first;
    while (last + 1 < static_cast<int>(code.size()) && code[last + 1] <= high &&
           g[last + 1] > g[last])
      ++last;
    if (last - first < 2) throw NoRisingCurve(what_, curve_.reference_code);
    ResponseCurve result = curve_;
    result.code.assign(code.begin() + first, code.begin() + last + 1);
    result.sigma.assign(curve_.sigma.begin() + first, curve_.sigma.begin() + last + 1);
    result.log_exposure.clear();
    for (int k = first; k <= last; ++k) result.log_exposure.push_back(g[k] - g[reference]);
    return result;
  }

  JointResponse joint_;
  const FitResponseOptions options_;
  const std::string what_;
  SplineResponse spline_;
  ResponseCurve curve_;  // on all nodes, rising
};

}  // namespace

FittedResponse FitResponse(const ResponseSamples& samples, std::span<const double> exposures_s,
                           double saturation_code, double reference_code,
                           const FitResponseOptions& options, const std::string& what) {
  if (options.method == ResponseMethod::kPublished)
    return FitPublishedResponse(samples, exposures_s, reference_code, what);
  Fit fit(samples, exposures_s, saturation_code, reference_code, options, what);
  FittedResponse smooth = fit.Smooth();
  switch (options.method) {
    case ResponseMethod::kRobertson:
      return fit.Robertson();
    case ResponseMethod::kPolynomial:
      return fit.Polynomial(smooth.curve);
    default:
      return smooth;
  }
}

}  // namespace luxfield::reconstruct
