#include "luxfield/bench/bench_stacks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/bench/foreign_mergers.h"
#include "luxfield/core/error.h"
#include "luxfield/core/npy.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/reconstruct/calibrate/response/calibrate_response.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;
using reconstruct::PictureStack;
using reconstruct::ResponseCurve;
using reconstruct::ResponseMethod;

constexpr double kFull_e = 20000, kReadNoise_e = 6, kLeastSeen_e = 200;
constexpr double kExposures_s[] = {0.01, 0.03, 0.1, 0.25, 1, 3.5};
constexpr std::string_view kChannels = "RGB";
constexpr ResponseMethod kOurs[] = {ResponseMethod::kDebevecMalik, ResponseMethod::kRobertson,
                                    ResponseMethod::kPolynomial};

// Share of saturation -> share of the largest code: a power with a toe and a shoulder.
double Develop(double share) {
  const double y = std::pow(share, 0.6);
  return y / (y + 0.45 * (1 - y));
}

// In exposures that saturate, per second.
std::vector<double> Ramp(int width, int height) {
  std::vector<double> radiance;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      radiance.push_back(1e-3 * std::pow(10.0, 5.5 * (column + 0.5) / width));
  return radiance;
}

PictureStack TakeStack(const BenchStacksOptions& options, int bits,
                       const std::vector<double>& radiance) {
  PictureStack stack{options.width, options.height, 1, bits, {}};
  for (const double exposure_s : kExposures_s) {
    std::vector<std::uint16_t> code(radiance.size());
    const std::size_t picture = stack.pictures.size();
    core::ParallelFor(code.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        core::Random random(options.seed, picture, static_cast<std::uint32_t>(p));
        const double electrons = random.Poisson(kFull_e * exposure_s * radiance[p]) +
                                 kReadNoise_e * random.Normal(),
                     share = Develop(std::clamp(electrons / kFull_e, 0.0, 1.0));
        code[p] = static_cast<std::uint16_t>(std::round(share * ((1 << bits) - 1)));
      }
    });
    stack.pictures.push_back({exposure_s, std::move(code)});
  }
  return stack;
}

// What a merger is judged by: radiance of the pixels to look at, 0 elsewhere, and those that no
// merger can know.
struct Truth {
  std::vector<double> radiance;
  std::vector<bool> saturated;
  bool exact = true;
};

Truth TruthOf(const std::vector<double>& radiance) {
  Truth truth{std::vector<double>(radiance.size(), 0.0), {}};
  const auto [least, most] = std::minmax_element(std::begin(kExposures_s), std::end(kExposures_s));
  for (std::size_t p = 0; p < radiance.size(); ++p) {
    if (radiance[p] * *most * kFull_e > kLeastSeen_e && radiance[p] * *least < 0.97)
      truth.radiance[p] = radiance[p];
    truth.saturated.push_back(radiance[p] * *least > 1.1);
  }
  return truth;
}

// Radiance by somebody else's curve: the means of g(z) - ln t with the weights of Debevec and Malik
// (1997, eq. 4 and 6), of pixels with a code between 10 and 245 in one picture at least.
Truth ByExpectedCurve(const PictureStack& grey, const std::vector<double>& g) {
  Truth truth{std::vector<double>(grey.plane_size(), 0.0), {}, false};
  for (std::size_t p = 0; p < grey.plane_size(); ++p) {
    double sum = 0, weights = 0;
    bool exposed = false;
    for (const auto& picture : grey.pictures) {
      const int z = picture.code[p], weight = std::min(z, 255 - z);
      exposed |= weight >= 10;
      sum += weight * (g[static_cast<std::size_t>(z)] - std::log(picture.exposure_s));
      weights += weight;
    }
    if (exposed) truth.radiance[p] = std::exp(sum / weights);
    truth.saturated.push_back(grey.pictures.front().code[p] == 255);
  }
  return truth;
}

// `sigma` empty: none is stated. What is flagged, or not finite and above 0, is no number.
void Judge(const std::vector<float>& radiance, std::span<const float> sigma,
           std::span<const std::uint32_t> mask, const Truth& truth, json& row) {
  std::vector<double> ratios;
  double seen = 0, saturated = 0, invented = 0;
  const auto number = [&](std::size_t p) {
    return std::isfinite(radiance[p]) && radiance[p] > 0 && (mask.empty() || mask[p] == 0);
  };
  for (std::size_t p = 0; p < radiance.size(); ++p) {
    seen += truth.radiance[p] > 0;
    saturated += truth.saturated[p];
    invented += truth.saturated[p] && number(p);
    if (truth.radiance[p] > 0 && number(p)) ratios.push_back(radiance[p] / truth.radiance[p]);
  }
  const double scale = core::Median(ratios);
  std::vector<double> errors;
  double squares = 0;
  for (const double ratio : ratios) {
    errors.push_back(std::abs(ratio / scale - 1));
    squares += std::pow(std::min(errors.back(), 1.0), 2);
  }
  const auto count = static_cast<double>(ratios.size());
  row["rms"] = 100 * std::sqrt(squares / count);
  row["median"] = 100 * core::Median(errors);
  row["seen"] = 100 * count / seen;
  if (saturated > 0) row["invented"] = 100 * invented / saturated;
  if (sigma.empty()) return;
  double in_sigma = 0;
  for (std::size_t p = 0; p < radiance.size(); ++p)
    if (truth.radiance[p] > 0 && number(p))
      in_sigma += std::pow((radiance[p] / scale - truth.radiance[p]) * scale / sigma[p], 2);
  row["sigma"] = std::sqrt(in_sigma / count);
}

PictureStack OneChannel(const PictureStack& stack, int channel) {
  PictureStack one{stack.width, stack.height, 1, stack.bits, {}};
  for (std::size_t k = 0; k < stack.pictures.size(); ++k) {
    const auto plane = stack.plane(k, channel);
    one.pictures.push_back({stack.pictures[k].exposure_s, {plane.begin(), plane.end()}});
  }
  return one;
}

struct OurFit {
  ResponseMethod method;
  ResponseCurve curve;
  double calibrate_s = 0;
};

OurFit Calibrate(const PictureStack& grey, ResponseMethod method) {
  reconstruct::CalibrateResponseOptions how;
  how.fit.method = method;
  const core::Stopwatch calibration;
  ResponseCurve curve = reconstruct::CalibrateResponse(grey, how).curves()[0];
  return {method, std::move(curve), calibration.WallSeconds()};
}

// What ours and the others make of one stack.
struct Mergers {
  std::vector<OurFit> ours;
  std::vector<ForeignMerge> others;
};

Mergers RunMergers(const PictureStack& grey, const std::filesystem::path& folder) {
  Mergers mergers;
  for (const ResponseMethod method : kOurs) mergers.ours.push_back(Calibrate(grey, method));
  mergers.others = MergeWithOthers(grey, 0, folder);
  return mergers;
}

void JudgeMergers(const std::string& name, const PictureStack& grey, const Truth& truth,
                  const Mergers& mergers, json& rows) {
  for (const OurFit& fit : mergers.ours) {
    const core::Stopwatch merging;
    const auto merged = reconstruct::MergeStack(grey, std::span(&fit.curve, 1));
    json row = {{"stack", name},
                {"merger", "ours " + reconstruct::ResponseMethodName(fit.method)},
                {"calibrate_s", fit.calibrate_s},
                {"merge_s", merging.WallSeconds()}};
    Judge(merged.radiance.data,
          truth.exact ? std::span<const float>(merged.sigma.data) : std::span<const float>{},
          merged.mask, truth, row);
    rows.push_back(row);
  }
  for (const ForeignMerge& other : mergers.others) {
    json row = {{"stack", name}, {"merger", other.name}};
    if (other.refused.empty()) {
      row["calibrate_s"] = other.calibrate_s;
      row["merge_s"] = other.merge_s;
      Judge(other.radiance, {}, {}, truth, row);
    } else {
      row["refused"] = other.refused;
    }
    rows.push_back(row);
  }
}

// g at codes `from` to `to`, 0 at 128, beside an expected one at all codes.
struct ComparedCurve {
  std::string fit;
  int from = 10, to = 245;
  std::vector<double> g = std::vector<double>(256, 0.0), sigma;  // sigma empty: not stated
};

ComparedCurve Ours(const OurFit& fit) {
  const ResponseCurve& curve = fit.curve;
  ComparedCurve result{.fit = "ours " + reconstruct::ResponseMethodName(fit.method), .sigma = {}};
  result.from = std::max(result.from, static_cast<int>(curve.low_code()));
  result.to = std::min(result.to, static_cast<int>(curve.high_code()));
  if (fit.method != ResponseMethod::kPublished) result.sigma.assign(256, 0.0);
  for (int z = result.from; z <= result.to; ++z) {
    result.g[z] = curve.LogExposure(z) - curve.LogExposure(128);
    if (!result.sigma.empty()) result.sigma[z] = curve.Sigma(z);
  }
  return result;
}

ComparedCurve Theirs(const ForeignMerge& other) {
  ComparedCurve result{.fit = other.name, .sigma = {}};
  for (int z = 0; z < 256; ++z)
    result.g[z] = std::log(std::max(other.curve[z], 1e-12) / other.curve[128]);
  return result;
}

json CompareCurves(const std::string& channel, const ComparedCurve& curve,
                   const std::vector<double>& expected) {
  double squares = 0, in_sigma = 0, count = 0, steps = 0, step_count = 0;
  for (int z = curve.from; z <= curve.to; ++z) {
    const double difference = curve.g[z] - expected[z];
    squares += difference * difference;
    ++count;
    if (!curve.sigma.empty() && z != 128) in_sigma += std::pow(difference / curve.sigma[z], 2);
    int brighter = z;
    while (brighter <= curve.to && expected[brighter] - expected[z] < std::log(8)) ++brighter;
    if (brighter > curve.to) continue;
    steps += std::pow(curve.g[brighter] - expected[brighter] - difference, 2);
    ++step_count;
  }
  json row = {{"channel", channel},
              {"fit", curve.fit},
              {"from", curve.from},
              {"to", curve.to},
              {"rms", std::sqrt(squares / count)}};
  if (!curve.sigma.empty()) row["in_sigma"] = std::sqrt(in_sigma / count);
  row["steps"] = std::sqrt(steps / std::max(step_count, 1.0));
  return row;
}

void Frobisher(const BenchStacksOptions& options, json& merges, json& curves) {
  std::vector<std::filesystem::path> files;
  for (const int number : {2600, 2601, 2602})
    files.push_back(options.frobisher / fmt::format("frobisher_001__IMG_{}.jpg", number));
  const PictureStack stack = reconstruct::ReadPictureStack(files, {});
  for (const char letter : options.channels) {
    const auto channel = static_cast<int>(kChannels.find(letter));
    const std::string name(1, letter);
    const PictureStack grey = OneChannel(stack, channel);
    const auto expected = core::ReadNpy(options.frobisher /
                                        fmt::format("calibration__test_g_solve_g_{}.npy", channel));
    const Mergers mergers = RunMergers(grey, options.folder);
    curves.push_back(
        CompareCurves(name, Ours(Calibrate(grey, ResponseMethod::kPublished)), expected));
    for (const OurFit& fit : mergers.ours)
      curves.push_back(CompareCurves(name, Ours(fit), expected));
    for (const ForeignMerge& other : mergers.others)
      if (!other.curve.empty()) curves.push_back(CompareCurves(name, Theirs(other), expected));
    JudgeMergers("Frobisher " + name, grey, ByExpectedCurve(grey, expected), mergers, merges);
  }
}

}  // namespace

json BenchStacks(const BenchStacksOptions& options) {
  for (const char letter : options.channels)
    if (kChannels.find(letter) == std::string_view::npos)
      throw InputError(
          fmt::format("--channels = {} must be of the letters {}", options.channels, kChannels));
  std::filesystem::create_directories(options.folder);
  json merges = json::array(), curves = json::array();
  const std::vector<double> radiance = Ramp(options.width, options.height);
  for (const int bits : {8, 16}) {
    if (radiance.empty()) continue;
    const PictureStack stack = TakeStack(options, bits, radiance);
    JudgeMergers(fmt::format("{} bit", bits), stack, TruthOf(radiance),
                 RunMergers(stack, options.folder), merges);
  }
  if (!options.frobisher.empty()) Frobisher(options, merges, curves);
  return {{"merges", merges}, {"curves", curves}};
}

}  // namespace luxfield::bench
