#include "luxfield/reconstruct/solve/report.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/core/simd.h"
#include "luxfield/lightfield/edge_light_json.h"
#include "luxfield/reconstruct/solve/report_json.h"

namespace luxfield::reconstruct {
namespace {

struct Sums {
  double positive = 0, negative = 0, squares = 0;  // `negative` of magnitudes
  float min = std::numeric_limits<float>::infinity(), max = -min;
};

LUXFIELD_SIMD_CLONES Sums SumUp(std::span<const float> values) {
  constexpr std::size_t kLanes = 8;
  typedef float Floats __attribute__((vector_size(kLanes * sizeof(float))));
  typedef double Doubles __attribute__((vector_size(kLanes * sizeof(double))));
  Sums sums;
  const Floats none{};
  Floats least = none + sums.min, most = none + sums.max;
  Doubles positive{}, negative{}, squares{};
  std::size_t at = 0;
  for (; at + kLanes <= values.size(); at += kLanes) {
    Floats c;
    std::memcpy(&c, values.data() + at, sizeof c);
    const Doubles wide = __builtin_convertvector(c, Doubles);
    positive += __builtin_convertvector(c < 0 ? none : c, Doubles);
    negative -= __builtin_convertvector(c < 0 ? c : none, Doubles);
    squares += wide * wide;
    least = c < least ? c : least;
    most = c > most ? c : most;
  }
  for (std::size_t k = 0; k < kLanes; ++k) {
    sums.positive += positive[k];
    sums.negative += negative[k];
    sums.squares += squares[k];
    sums.min = std::min(sums.min, least[k]);
    sums.max = std::max(sums.max, most[k]);
  }
  for (; at < values.size(); ++at) {
    const double c = values[at];
    (c < 0 ? sums.negative : sums.positive) += std::abs(c);
    sums.squares += c * c;
    sums.min = std::min(sums.min, values[at]);
    sums.max = std::max(sums.max, values[at]);
  }
  return sums;
}

}  // namespace

float NthSmallest(std::span<const float> values, std::size_t n) {
  constexpr std::uint32_t kSign = 0x80000000u, kLow = 0xFFFFu;
  // Floats in their order as whole numbers in theirs.
  const auto place = [](float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return bits & kSign ? ~bits : bits | kSign;
  };
  std::vector<std::size_t> counts(kLow + 1);
  const auto find = [&] {  // the bin that place n lies in; n is then counted from its first one
    std::uint32_t bin = 0;
    for (; n >= counts[bin]; ++bin) n -= counts[bin];
    return bin;
  };
  for (const float value : values) ++counts[place(value) >> 16];
  const std::uint32_t high = find();
  std::fill(counts.begin(), counts.end(), 0);
  for (const float value : values)
    if (place(value) >> 16 == high) ++counts[place(value) & kLow];
  const std::uint32_t found = high << 16 | find();
  return std::bit_cast<float>(found & kSign ? found & ~kSign : ~found);
}

CoefficientStatistics Statistics(const lightfield::LightField& coefficients,
                                 const lightfield::LightField& sigma) {
  CoefficientStatistics result;
  if (coefficients.data.empty()) return result;
  const Sums sums = SumUp(coefficients.data);
  const double variances = SumUp(sigma.data).squares;
  result.min = sums.min;
  result.max = sums.max;
  result.mean = (sums.positive - sums.negative) / static_cast<double>(coefficients.data.size());
  result.negative_energy = sums.positive > 0 ? sums.negative / sums.positive : 0;
  result.sigma_relative = sums.squares > 0 ? std::sqrt(variances / sums.squares) : 0;
  if (!sigma.data.empty()) result.sigma_median = NthSmallest(sigma.data, sigma.data.size() / 2);
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
