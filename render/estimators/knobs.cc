#include "luxfield/render/estimators/knobs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/sample/sampling_types.clh"

namespace luxfield::render {
namespace {

constexpr int kMaxDepth = 64;
const std::vector<std::string> kAllocations{"rounded", "systematic"},
    kInversions{"bisection", "secant"}, kCorrelations{"shared", "decorrelated"},
    kSequences{"halton", "sobol", "mersenne"}, kBalances{"cosine", "uniform", "energy", "none"},
    kSets{"shared", "interleaved", "scrambled"}, kStrategiesFor{"area-lights", "all"},
    kStrategies{"balance", "power",        "maximum", "light", "brdf",
                "fixed",   "second-order", "newton",  "lobe",  "given"};

// Index of `value` among `choices`.
int Choice(const std::string& name, const std::string& value,
           const std::vector<std::string>& choices) {
  const auto it = std::find(choices.begin(), choices.end(), value);
  if (it == choices.end())
    throw InputError(
        fmt::format("knob {} = '{}'; use one of {}", name, value, fmt::join(choices, ", ")));
  return static_cast<int>(it - choices.begin());
}

template <typename T>
T Number(const std::string& name, const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    throw InputError(fmt::format("knob {} = '{}' is no number", name, text));
  return value;
}

}  // namespace

void Knobs::Set(const std::string& assignment) {
  const auto equals = assignment.find('=');
  const std::string name = assignment.substr(0, equals),
                    value = equals == std::string::npos ? "" : assignment.substr(equals + 1);
  if (name == "basis-share")
    basis_share = Number<float>(name, value);
  else if (name == "brdf-share")
    brdf_share = Number<float>(name, value);
  else if (name == "allocation")
    systematic = Choice(name, value, kAllocations) == 1;
  else if (name == "inversion")
    secant = Choice(name, value, kInversions) == 1;
  else if (name == "depth")
    depth = Number<int>(name, value);
  else if (name == "correlation")
    decorrelated = Choice(name, value, kCorrelations) == 1;
  else if (name == "sequence")
    sequence = static_cast<Sequence>(Choice(name, value, kSequences));
  else if (name == "strategies")
    strategies.strategies = static_cast<Strategies>(Choice(name, value, kStrategies));
  else if (name == "strategies-for")
    strategies.everywhere = Choice(name, value, kStrategiesFor) == 1;
  else if (name == "light-share")
    strategies.light_share = Number<float>(name, value);
  else if (name == "pilot")
    strategies.pilot = Number<int>(name, value);
  else if (name == "environment-balance")
    environment.balance = static_cast<TileBalance>(Choice(name, value, kBalances));
  else if (name == "environment-tiles")
    environment.tiles = Number<int>(name, value);
  else if (name == "environment-sets")
    environment.sets = static_cast<SampleSets>(Choice(name, value, kSets));
  else if (name == "environment-brdf-share")
    environment.brdf_share = Number<float>(name, value);
  else if (name == "environment-compensation")
    environment.compensation = Number<float>(name, value);
  else
    throw InputError(
        fmt::format("unknown knob '{}'; use basis-share, brdf-share, allocation, inversion, depth, "
                    "correlation, sequence, strategies, strategies-for, light-share, pilot, or "
                    "environment-balance, -tiles, -sets, -brdf-share or "
                    "-compensation",
                    name));
  Validate();
}

std::string Knobs::Text() const {
  return fmt::format(
      "basis-share={} brdf-share={} allocation={} inversion={} depth={} correlation={} sequence={}",
      basis_share, brdf_share, kAllocations[systematic], kInversions[secant], depth,
      kCorrelations[decorrelated], kSequences[static_cast<int>(sequence)]);
}

bool IsAdaptive(Strategies strategies) {
  return strategies == Strategies::kSecondOrder || strategies == Strategies::kNewton;
}

std::string StrategyKnobs::Text() const {
  return fmt::format("strategies={} strategies-for={} light-share={} pilot={}",
                     kStrategies[static_cast<int>(strategies)], kStrategiesFor[everywhere],
                     light_share, pilot);
}

std::string EnvironmentKnobs::Text() const {
  return fmt::format("balance={} tiles={} sets={} brdf-share={} compensation={}",
                     kBalances[static_cast<int>(balance)], tiles, kSets[static_cast<int>(sets)],
                     brdf_share, compensation);
}

void Knobs::Validate() const {
  if (!(basis_share >= 0 && basis_share <= 1))
    throw InputError(fmt::format("knob basis-share = {} must lie in [0, 1]", basis_share));
  if (!(brdf_share >= 0 && brdf_share <= 1))
    throw InputError(fmt::format("knob brdf-share = {} must lie in [0, 1]", brdf_share));
  if (depth < 0 || depth > kMaxDepth)
    throw InputError(fmt::format("knob depth = {} must lie in [0, {}]", depth, kMaxDepth));
  if (!(strategies.light_share >= 0 && strategies.light_share <= 1))
    throw InputError(
        fmt::format("knob light-share = {} must lie in [0, 1]", strategies.light_share));
  if (strategies.pilot < 2 || strategies.pilot > kMaxPilot || strategies.pilot % 2 != 0)
    throw InputError(fmt::format("knob pilot = {} must be even and lie in [2, {}]",
                                 strategies.pilot, int{kMaxPilot}));
  if (!(environment.brdf_share >= 0 && environment.brdf_share <= 1))
    throw InputError(
        fmt::format("knob environment-brdf-share = {} must lie in [0, 1]", environment.brdf_share));
}

std::vector<std::string> KnobHelp() {
  return {
      "windowed  basis-share=0..1                share of the samples drawn from Phi (0.5)",
      "windowed, cells  brdf-share=0..1          share that follows narrow lobes (0.5)",
      "thesis    allocation=rounded|systematic   samples per image",
      "thesis    inversion=bisection|secant      search in the CDFs",
      "thesis    depth=0..64                     steps before a straight line, 0: to the texel",
      "thesis    correlation=shared|decorrelated one sequence for all, or shifted per pixel, image",
      "thesis    sequence=halton|sobol|mersenne  sobol is scrambled",
      "area lights:",
      "  strategies=balance|power|maximum|light|brdf|fixed|second-order|newton|lobe   how samples "
      "that "
      "follow a light and those that follow the BRDF are shared out and combined (lobe)",
      "  strategies-for=area-lights|all                    also for luminaires and environment, "
      "instead of their estimators (area-lights)",
      "  light-share=0..1                                  of fixed, samples that follow the light",
      "  pilot=2..64                                       of second-order and newton, samples "
      "that "
      "choose the share (64)",
      "the environment map:",
      "  environment-balance=cosine|uniform|energy|none    how samples are shared out to faces",
      "  environment-tiles=1..16                           tiles along a face, each as a face (1)",
      "  environment-sets=shared|interleaved|scrambled     samples of all pixels, of every fourth "
      "one each way, or of each",
      "  environment-brdf-share=0..1                       share that follows the BRDF (0.5)",
      "  environment-compensation=0..1                     of the mean, left to the BRDF (0)"};
}

}  // namespace luxfield::render
