#include "study/bench_balance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/colour.h"
#include "core/error.h"
#include "core/measures.h"
#include "core/progress.h"
#include "study/lights_apart.h"
#include "study/reference_picture.h"

namespace luxfield::study {
namespace {

using render::Strategies;

constexpr std::uint64_t kSeed = 11, kReferenceSeed = 0x62616c616e6365;  // nobody counts up to it
constexpr int kLeastSeeds = 4;
constexpr int kMostSamples = 1 << 16;  // of a picture at equal time

struct Named {
  const char* name;
  Strategies strategies;
};
constexpr Named kStrategies[] = {
    {"balance", Strategies::kBalance},    {"power", Strategies::kPower},
    {"maximum", Strategies::kMaximum},    {"light_only", Strategies::kLight},
    {"brdf_only", Strategies::kBrdf},     {"alpha_second_order", Strategies::kSecondOrder},
    {"alpha_newton", Strategies::kNewton}};
constexpr float kShares[] = {0.025f, 0.1f, 0.2f, 0.35f, 0.5f, 0.65f, 0.8f, 0.9f, 0.975f};

// What a reference divides variances by, pixel by pixel.
std::vector<double> Scales(const core::Image& reference) {
  const core::Image luminance = core::LuminanceImage(reference);
  const auto count = static_cast<double>(luminance.data.size());
  const double mean = std::accumulate(luminance.data.begin(), luminance.data.end(), 0.0) / count;
  std::vector<double> scales;
  for (const float y : luminance.data)
    scales.push_back(1 / (double{y} * y + 1e-4 * mean * mean) / count);
  return scales;
}

// Pictures of several seeds.
struct Runs {
  std::vector<core::Image> luminance;  // of each seed
  double mean_lab = 0, wall_s = 0, core_s = 0;
};

Runs RunSeeds(LightsApart& scene, const StrategySetting& setting, int seeds,
              const core::Image& reference) {
  Runs runs;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto picture = scene.Light(setting, kSeed + seed);
    runs.mean_lab += core::Compare(picture.radiance, reference).mean_lab / seeds;
    if (seed == 0 || picture.core_s < runs.core_s) runs.core_s = picture.core_s;
    if (seed == 0 || picture.wall_s < runs.wall_s) runs.wall_s = picture.wall_s;
    runs.luminance.push_back(core::LuminanceImage(picture.radiance));
  }
  return runs;
}

// Variance over the seeds first, first + step, ..., pixel by pixel.
std::vector<double> Variances(const Runs& runs, int first, int step) {
  std::vector<double> mean(runs.luminance[0].data.size(), 0.0), squares = mean;
  int count = 0;
  for (std::size_t seed = first; seed < runs.luminance.size(); seed += step) {
    ++count;
    for (std::size_t k = 0; k < mean.size(); ++k) {
      const double difference = runs.luminance[seed].data[k] - mean[k];
      mean[k] += difference / count;
      squares[k] += difference * (runs.luminance[seed].data[k] - mean[k]);
    }
  }
  for (double& value : squares) value /= count - 1;
  return squares;
}

struct Estimate {
  double value = 0, standard_error = 0;
};

// Squared deviations of each seed's picture from the mean of all are as many estimates.
Estimate RelativeVariance(const Runs& runs, const std::vector<double>& scales) {
  const auto seeds = static_cast<double>(runs.luminance.size());
  std::vector<double> mean(scales.size(), 0.0);
  for (const auto& picture : runs.luminance)
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += picture.data[k] / seeds;
  Estimate estimate;
  double squares = 0;
  for (const auto& picture : runs.luminance) {
    double sum = 0;
    for (std::size_t k = 0; k < mean.size(); ++k)
      sum += scales[k] * std::pow(picture.data[k] - mean[k], 2) * seeds / (seeds - 1);
    estimate.value += sum / seeds;
    squares += sum * sum / seeds;
  }
  estimate.standard_error =
      std::sqrt(std::max(0.0, squares - estimate.value * estimate.value) / (seeds - 1));
  return estimate;
}

// Mean over 3 x 3 pixels of those that hit something, of values in the order of scene.hit().
std::vector<double> Smoothed(const LightsApart& scene, const std::vector<double>& values) {
  const int width = scene.width(), height = scene.height();
  std::vector<int> place(static_cast<std::size_t>(width) * height, -1);
  for (std::size_t k = 0; k < scene.hit().size(); ++k) place[scene.hit()[k]] = static_cast<int>(k);
  std::vector<double> smooth;
  for (const std::size_t pixel : scene.hit()) {
    const int row = static_cast<int>(pixel) / width, column = static_cast<int>(pixel) % width;
    double sum = 0;
    int count = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
        if (const int k = place[r * width + c]; k >= 0) {
          sum += values[k];
          ++count;
        }
    smooth.push_back(sum / count);
  }
  return smooth;
}

// Relative variance of the share that is best for each pixel: chosen on the even seeds and judged
// on the odd ones, and the other way round.
double BestOfEachPixel(const LightsApart& scene, const std::vector<Runs>& by_share,
                       const std::vector<double>& scales) {
  double sum = 0;
  for (const int chosen_on : {0, 1}) {
    std::vector<double> least(scales.size(), std::numeric_limits<double>::infinity()),
        judged(scales.size(), 0.0);
    for (const Runs& runs : by_share) {
      const auto choose = Smoothed(scene, Variances(runs, chosen_on, 2)),
                 judge = Variances(runs, 1 - chosen_on, 2);
      for (std::size_t k = 0; k < scales.size(); ++k)
        if (choose[k] < least[k]) {
          least[k] = choose[k];
          judged[k] = judge[k];
        }
    }
    for (std::size_t k = 0; k < scales.size(); ++k) sum += scales[k] * judged[k] / 2;
  }
  return sum;
}

ReferencePicture MakeLightsReference(LightsApart& scene, const BenchBalanceOptions& options) {
  StrategySetting setting{Strategies::kNewton, std::max(1, options.reference_samples / 2)};
  core::Image a = scene.Light(setting, kReferenceSeed).radiance;
  return MakeReference(std::move(a), scene.Light(setting, kReferenceSeed + 1).radiance);
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
        scene_(device,
               scene::ReadScene(path, {.light_fields = {},
                                       .tables = {},
                                       .width = options.width,
                                       .height = options.height}),
               options.shadows),
        reference_(MakeLightsReference(scene_, options)),
        scales_(Scales(reference_.mean)) {}

  nlohmann::json StrategyRows() {
    nlohmann::json rows = nlohmann::json::array();
    for (const Named& named : kStrategies) {
      const StrategySetting setting{named.strategies, options_.samples_per_light, 0.5f,
                                    options_.pilot};
      const Runs runs = RunSeeds(scene_, setting, options_.seeds, reference_.mean);
      StrategyFigures& figures = figures_[named.name];
      figures = {RelativeVariance(runs, scales_), runs.core_s};
      const StrategyFigures& balance = figures_.at("balance");
      StrategySetting equal_time = setting;
      equal_time.samples_per_light = std::clamp(
          static_cast<int>(std::lround(options_.samples_per_light * balance.core_s / runs.core_s)),
          1, kMostSamples);
      const Runs at_equal_time = RunSeeds(scene_, equal_time, options_.seeds, reference_.mean);
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
    double best = std::numeric_limits<double>::infinity(), best_share = 0;
    for (const float share : kShares) {
      by_share.push_back(RunSeeds(scene_, {Strategies::kFixed, options_.samples_per_light, share},
                                  options_.seeds, reference_.mean));
      const double variance = RelativeVariance(by_share.back(), scales_).value;
      if (variance < best) {
        best = variance;
        best_share = double{share};
      }
    }
    return {{"scene", name_},
            {"best_share", best_share},
            {"rel_variance", best},
            {"of_each_pixel", BestOfEachPixel(scene_, by_share, scales_)},
            {"second_order", AfterPilot("alpha_second_order")},
            {"newton", AfterPilot("alpha_newton")}};
  }

  nlohmann::json Claim() const {
    const StrategyFigures& newton = figures_.at("alpha_newton");
    nlohmann::json claim{{"scene", name_}};
    bool holds = true;
    for (const char* other : {"balance", "power", "maximum"}) {
      const StrategyFigures& figures = figures_.at(other);
      const double ratio = newton.efficiency() / figures.efficiency();
      const auto relative = [](const Estimate& e) { return e.standard_error / e.value; };
      claim[std::string("over_") + other] = ratio;
      claim[std::string("over_") + other + "_se"] =
          ratio * std::hypot(relative(newton.variance), relative(figures.variance));
      holds = holds && ratio > 1;
    }
    claim["holds"] = holds;
    return claim;
  }

 private:
  // Relative variance of N samples of the kind that a pilot of M leaves.
  double AfterPilot(const char* strategy) const {
    const double n = options_.samples_per_light,
                 m = std::min(options_.pilot, options_.samples_per_light / 4 * 2);
    return (n * figures_.at(strategy).variance.value - m * figures_.at("balance").variance.value) /
           (n - m);
  }

  const BenchBalanceOptions& options_;
  std::string name_;
  LightsApart scene_;
  ReferencePicture reference_;
  std::vector<double> scales_;
  std::map<std::string, StrategyFigures> figures_;
};

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
                        {"claims", nlohmann::json::array()}};
  core::Progress progress("scenes", options.scenes.size());
  for (const auto& path : options.scenes) {
    SceneBench bench(device, path, options);
    for (auto& row : bench.StrategyRows()) result["rows"].push_back(std::move(row));
    if (options.search) result["search"].push_back(bench.SearchRow());
    result["claims"].push_back(bench.Claim());
    progress.Advance();
  }
  return result;
}

}  // namespace luxfield::study
