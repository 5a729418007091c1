#include "luxfield/reconstruct/solve/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/lightfield/edge_light_json.h"
#include "luxfield/reconstruct/solve/report_json.h"

namespace luxfield::reconstruct {

CoefficientStatistics Statistics(const lightfield::LightField& coefficients,
                                 const lightfield::LightField& sigma) {
  CoefficientStatistics result;
  if (coefficients.data.empty()) return result;
  double positive = 0, negative = 0, squares = 0, variances = 0;
  result.min = result.max = coefficients.data[0];
  for (const float value : coefficients.data) {
    const double c = value;
    (c < 0 ? negative : positive) += std::abs(c);
    squares += c * c;
    result.min = std::min(result.min, c);
    result.max = std::max(result.max, c);
  }
  for (const float value : sigma.data) variances += static_cast<double>(value) * value;
  result.mean = (positive - negative) / static_cast<double>(coefficients.data.size());
  result.negative_energy = positive > 0 ? negative / positive : 0;
  result.sigma_relative = squares > 0 ? std::sqrt(variances / squares) : 0;
  if (!sigma.data.empty()) {
    std::vector<float> sorted = sigma.data;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    result.sigma_median = *middle;
  }
  return result;
}

nlohmann::json ToJson(const ReconstructionReport& report) {
  nlohmann::json json{{"images", report.images},
                      {"solve", report.solve},
                      {"condition", report.condition},
                      {"noise_gain", report.noise_gain},
                      {"worst_gain", report.worst_gain},
                      {"negative_energy", report.coefficients.negative_energy},
                      {"c_min", report.coefficients.min},
                      {"c_max", report.coefficients.max},
                      {"c_mean", report.coefficients.mean},
                      {"sigma_median", report.coefficients.sigma_median},
                      {"sigma_relative", report.coefficients.sigma_relative},
                      {"texels_incomplete", report.incomplete.incomplete},
                      {"texels_with_gaps", report.incomplete.with_gaps},
                      {"texels_unknown", report.incomplete.unknown},
                      {"flags",
                       {{"off_sensor", report.off_sensor},
                        {"saturated", report.saturated},
                        {"too_dark", report.too_dark},
                        {"defect", report.defect}}}};
  const char* const kept[] = {"none", "flux", "moments"};
  json["kept"] = {{"u", kept[report.kept.u]}, {"v", kept[report.kept.v]}};
  if (report.moment_residual) json["moment_residual"] = *report.moment_residual;
  if (report.edges) json["edges"] = ToJson(*report.edges);
  json["warnings"] = report.warnings;
  if (report.filter_noise) json["filter_noise"] = *report.filter_noise;
  if (report.non_negative)
    json["non_negative"] = {{"metric", NonNegativeMetricName(report.non_negative->metric)},
                            {"pixels", report.non_negative->pixels},
                            {"unconverged", report.non_negative->unconverged},
                            {"iterations", report.non_negative->iterations},
                            {"worst_residual", report.non_negative->worst_residual}};
  // In the metric of irradiance first moments are not kept one by one.
  if (report.non_negative && report.non_negative->metric == NonNegativeMetric::kCoefficients)
    json["non_negative"]["moments_lost"] = report.non_negative->moments_lost;
  if (report.regularisation) {
    const RegularisationSummary& r = *report.regularisation;
    json["regularisation"] = {{"lambda", r.lambda},
                              {"chosen", r.chosen},
                              {"noise_before", r.noise_before},
                              {"noise", r.noise},
                              {"bias", r.bias},
                              {"flux_bias", r.flux_bias},
                              {"worst_bias", r.worst_bias},
                              {"noise_gain", r.noise_gain},
                              {"texels", r.texels}};
  }
  return json;
}

}  // namespace luxfield::reconstruct
