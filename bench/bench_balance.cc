#include "luxfield/bench/bench_balance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/bench/strategy_variance.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/planning/reference_picture.h"

namespace luxfield::bench {
namespace {

using render::Strategies;

constexpr std::uint64_t kSeed = 11, kReferenceSeed = 0x62616c616e6365;  // nobody counts up to it
constexpr int kLeastSeeds = 4;
constexpr int kMostSamples = 1 << 16;  // of a picture at equal time
constexpr double kWorstZ = 3;          // one in 70 of eleven scenes by chance
constexpr int kLargestPilot = 64, kLongPilots = 16;

struct Named {
  const char* name;
  Strategies strategies;
};
constexpr Named kStrategies[] = {
    {"balance", Strategies::kBalance},     {"power", Strategies::kPower},
    {"maximum", Strategies::kMaximum},     {"light_only", Strategies::kLight},
    {"brdf_only", Strategies::kBrdf},      {"alpha_second_order", Strategies::kSecondOrder},
    {"alpha_newton", Strategies::kNewton}, {"alpha_lobe", Strategies::kLobe}};
constexpr float kShares[] = {0.025f, 0.1f, 0.2f, 0.35f, 0.5f, 0.65f, 0.8f, 0.9f, 0.975f};

planning::ReferencePicture MakeLightsReference(LightsApart& scene,
                                               const BenchBalanceOptions& options) {
  StrategySetting setting{Strategies::kPower, std::max(1, options.reference_samples / 2)};
  core::Image a = scene.Light(setting, kReferenceSeed).radiance;
  return planning::MakeReference(std::move(a), scene.Light(setting, kReferenceSeed + 1).radiance);
}

struct StrategyFigures {
  Estimate variance;
  double core_s = 0;
  double efficiency() const { return 1 / (variance.value * core_s); }
};

class SceneBench {
 public:
  SceneBench(const render::Device& device, const std::filesystem::path& path,
             const BenchBalanceOptions& options)
      : options_(options),
        name_(path.stem().string()),
        lit_(device, scene::ReadScene(path, {.light_fields = {},
                                             .tables = {},
                                             .width = options.width,
                                             .height = options.height})),
        scene_(lit_, options.shadows),
        reference_(MakeLightsReference(scene_, options)),
        scales_(VarianceScales(reference_.mean)) {}

  nlohmann::json StrategyRows() {
    nlohmann::json rows = nlohmann::json::array();
    for (const Named& named : kStrategies) {
      const StrategySetting setting = Setting(named.strategies);
      const Runs runs = RunSeeds(scene_, setting, kSeed, options_.seeds, reference_.mean);
      StrategyFigures& figures = figures_[named.name];
      figures = {RelativeVariance(runs, scales_), runs.core_s};
      const StrategyFigures& balance = figures_.at("balance");
      StrategySetting equal_time = setting;
      equal_time.samples_per_light = std::clamp(
          static_cast<int>(std::lround(options_.samples_per_light * balance.core_s / runs.core_s)),
          1, kMostSamples);
      const Runs at_equal_time =
          RunSeeds(scene_, equal_time, kSeed, options_.seeds, reference_.mean);
      rows.push_back(
          {{"scene", name_},
           {"strategy", named.name},
           {"spp", setting.samples_per_light},
           {"rel_variance", figures.variance.value},
           {"rel_variance_se", figures.variance.standard_error},
           {"mean_lab", runs.mean_lab},
           {"wall_s", runs.wall_s},
           {"core_s", runs.core_s},
           {"samples_per_s", static_cast<double>(scene_.hit().size() * scene_.names().size()) *
                                 setting.samples_per_light / runs.wall_s},
           {"efficiency", figures.efficiency()},
           {"rel_efficiency", figures.efficiency() / balance.efficiency()},
           {"equal_time_spp", equal_time.samples_per_light},
           {"equal_time_rel_variance", RelativeVariance(at_equal_time, scales_).value},
           {"equal_time_lab", at_equal_time.mean_lab},
           {"reference_rel_rmse", reference_.rel_rmse}});
    }
    return rows;
  }

  nlohmann::json SearchRow() {
    std::vector<Runs> by_share;
    double best = 0, best_share = 0;
    for (const float share : kShares) {
      by_share.push_back(RunSeeds(scene_, {Strategies::kFixed, options_.samples_per_light, share},
                                  kSeed, options_.seeds, reference_.mean));
      const double variance = RelativeVariance(by_share.back(), scales_).value;
      if (by_share.size() == 1 || variance < best) {
        best = variance;
        best_share = double{share};
      }
    }
    const auto shares = LongPilotShares();
    const int n = options_.samples_per_light, pilot = std::min(options_.pilot, n / 4 * 2);
    return {{"scene", name_},
            {"best_share", best_share},
            {"rel_variance", best},
            {"of_each_pixel", BestOfEachPixel(scene_, by_share, scales_)},
            {"known", GivenShares(shares, n)},
            {"known_rest", GivenShares(shares, n - pilot)},
            {"second_order", figures_.at("alpha_second_order").variance.value},
            {"newton", figures_.at("alpha_newton").variance.value},
            {"lobe", figures_.at("alpha_lobe").variance.value}};
  }

  nlohmann::json Claim(const char* strategy) const {
    const StrategyFigures& ours = figures_.at(strategy);
    nlohmann::json claim{{"scene", name_}, {"strategy", strategy}};
    bool holds = true;
    for (const char* other : {"balance", "power", "maximum"}) {
      const StrategyFigures& figures = figures_.at(other);
      const double ratio = ours.efficiency() / figures.efficiency();
      const auto relative = [](const Estimate& e) { return e.standard_error / e.value; };
      claim[std::string("over_") + other] = ratio;
      claim[std::string("over_") + other + "_se"] =
          ratio * std::hypot(relative(ours.variance), relative(figures.variance));
      holds = holds && ratio > 1;
    }
    claim["holds"] = holds;
    return claim;
  }

  // Of the relative variance of Newton steps over that of the second-order formula, less 1.
  Estimate NewtonOverSecondOrder() const {
    return RelativeDifference(figures_.at("alpha_second_order").variance,
                              figures_.at("alpha_newton").variance);
  }

  const std::string& name() const { return name_; }

 private:
  StrategySetting Setting(Strategies strategies) const {
    return {strategies, options_.samples_per_light, 0.5f, options_.pilot};
  }

  // Of each light, the mean over kLongPilots pilots of the largest size.
  std::vector<core::Image> LongPilotShares() {
    std::vector<core::Image> shares;
    const StrategySetting setting{Strategies::kNewton, 2 * kLargestPilot, 0.5f, kLargestPilot};
    for (int k = 0; k < kLongPilots; ++k) {
      const auto parts = scene_.LightParts(setting, kReferenceSeed + k);
      shares.resize(parts.size());
      for (std::size_t light = 0; light < parts.size(); ++light) {
        core::Image& mean = shares[light];
        if (k == 0) mean = core::Image(parts[light].light_share.width, 1, 1);
        for (std::size_t i = 0; i < mean.data.size(); ++i)
          mean.data[i] += parts[light].light_share.data[i] / kLongPilots;
      }
    }
    return shares;
  }

  double GivenShares(const std::vector<core::Image>& shares, int samples) {
    const StrategySetting setting{Strategies::kGiven, samples};
    return RelativeVariance(
               RunSeeds(scene_, setting, kSeed, options_.seeds, reference_.mean, shares), scales_)
        .value;
  }

  const BenchBalanceOptions& options_;
  std::string name_;
  render::LitScene lit_;
  LightsApart scene_;
  planning::ReferencePicture reference_;
  std::vector<double> scales_;
  std::map<std::string, StrategyFigures> figures_;
};

nlohmann::json StepRow(const std::string& scene, double difference, double standard_error) {
  const double z = standard_error > 0 ? difference / standard_error : 0;
  return {{"scene", scene},
          {"newton_over_second_order", difference},
          {"se", standard_error},
          {"z", z},
          {"holds", z < kWorstZ}};
}

void Validate(const BenchBalanceOptions& options) {
  if (options.seeds < kLeastSeeds)
    throw InputError(
        fmt::format("seeds = {}: a variance takes at least {}", options.seeds, kLeastSeeds));
  if (options.samples_per_light < 4 || options.reference_samples < 4)
    throw InputError("samples must be at least 4");
}

}  // namespace

nlohmann::json BenchBalance(const BenchBalanceOptions& options) {
  Validate(options);
  const render::Device device = render::Device::Open(options.device, options.threads);
  nlohmann::json result{{"rows", nlohmann::json::array()},
                        {"search", nlohmann::json::array()},
                        {"claims", nlohmann::json::array()},
                        {"steps", nlohmann::json::array()}};
  const auto scenes = static_cast<double>(options.scenes.size());
  double mean = 0, variance = 0;  // of what Newton steps add to the variance
  core::Progress progress("scenes", options.scenes.size());
  for (const auto& path : options.scenes) {
    SceneBench bench(device, path, options);
    for (auto& row : bench.StrategyRows()) result["rows"].push_back(std::move(row));
    if (options.search) result["search"].push_back(bench.SearchRow());
    for (const char* strategy : {"alpha_newton", "alpha_lobe"})
      result["claims"].push_back(bench.Claim(strategy));
    const Estimate step = bench.NewtonOverSecondOrder();
    result["steps"].push_back(StepRow(bench.name(), step.value, step.standard_error));
    mean += step.value / scenes;
    variance += std::pow(step.standard_error / scenes, 2);
    progress.Advance();
  }
  result["steps"].push_back(StepRow("all", mean, std::sqrt(variance)));
  return result;
}

}  // namespace luxfield::bench
