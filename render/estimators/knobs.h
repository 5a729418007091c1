// Settings of single sampling estimators, by name (docs/theory.md 6, 11).
//
//   estimator   knob          values
//   windowed    basis-share   0 to 1: share of the samples drawn from Phi_m, the rest from C
//   windowed,   brdf-share    0 to 1: share of the samples that follow a glossy BRDF whose lobe is
//   cells                     narrow against the lamp; fewer and none where it is broad
//   thesis      allocation    rounded | systematic
//   thesis      inversion     bisection | secant (regula falsi)
//   thesis      depth         steps of the inversion before a straight line; 0: to the texel
//   thesis      correlation   shared | decorrelated: a shift per pixel and image
//   thesis      sequence      halton | sobol (scrambled) | mersenne (MT19937)
//   two strategies            strategies, strategies-for, light-share, pilot:
//                             estimators/mis.h
//   the environment map       environment-balance, -tiles, -sets, -brdf-share, -compensation:
//                             estimators/environment.h and environment_light.h
#pragma once

#include <string>
#include <vector>

namespace luxfield::render {

enum class Sequence { kHalton, kSobol, kMersenne };

enum class TileBalance { kCosine, kUniform, kEnergy, kNone };  // EnvironmentBalance of the kernels
enum class SampleSets { kShared, kInterleaved, kScrambled };

// What decides on samples that follow a light or the BRDF (estimators/mis.h).
enum class Strategies {
  kBalance,
  kPower,
  kMaximum,
  kLight,
  kBrdf,
  kFixed,
  kSecondOrder,
  kNewton,
  kLobe,
  kGiven
};

// Whether the share of samples is chosen by a pilot.
bool IsAdaptive(Strategies strategies);

struct StrategyKnobs {
  Strategies strategies = Strategies::kLobe;
  bool everywhere = false;  // else for area lights alone: other lights have estimators of their own
  float light_share = 0.5f;  // kFixed
  int pilot = 64;            // samples; at most half of all

  // All of them as "name=value", separated by spaces.
  std::string Text() const;
};

struct EnvironmentKnobs {
  TileBalance balance = TileBalance::kCosine;
  int tiles = 1;  // along each side of a face
  SampleSets sets = SampleSets::kScrambled;
  float brdf_share = 0.5f;
  float compensation = 0;

  // All of them as "name=value", separated by spaces.
  std::string Text() const;
};

struct Knobs {
  float basis_share = 0.5f;
  float brdf_share = 0.5f;
  bool systematic = false;
  bool secant = false;
  int depth = 0;
  bool decorrelated = false;
  Sequence sequence = Sequence::kHalton;
  StrategyKnobs strategies{};
  EnvironmentKnobs environment{};

  // "depth=3". InputError for an unknown name or value.
  void Set(const std::string& assignment);
  // All but the strategies' and the environment map's as "name=value", separated by spaces.
  std::string Text() const;
  // InputError naming the knob that is out of range.
  void Validate() const;
};

// One line per knob for a verb's help: "thesis  sequence=halton|sobol|mersenne  ...".
std::vector<std::string> KnobHelp();

}  // namespace luxfield::render
