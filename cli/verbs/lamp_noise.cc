#include "luxfield/cli/verbs/lamp_noise.h"

#include <fmt/format.h>

#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::cli {
namespace {

// What a file of sigma(C) says of how C came of E.
struct Solve {
  photometry::SolveMaps maps;
  std::string uncertainty;  // what follows for standard uncertainties
};

constexpr const char* kNoise =
    "Standard uncertainties (k = 1) are what the noise of the measurement leaves, from sigma(C); "
    "what all coefficients share (exposure times, drift, geometry, filters, calibration) is not in "
    "them: `luxfield budget` states it";

Solve SolveOf(const lightfield::LightField& sigma, const std::string& file) {
  const auto text = [&](const char* key) {
    const auto found = sigma.provenance.find(key);
    return found == sigma.provenance.end() ? std::string() : found->second;
  };
  const std::string solve = text("solve");
  if (solve == "none") return {{}, std::string(kNoise) + "."};
  if (solve == "regularised")
    throw InputError(file,
                     "belongs to a regularised solution, of which sigma does not say how "
                     "coefficients hang together",
                     "leave --sigma out, or reconstruct without --regularise");
  if (solve.empty())
    return {{},
            std::string(kNoise) +
                ". The file does not say how C was solved for, so coefficients are taken as "
                "independent, which overstates the uncertainty of flux, intensity and illuminance "
                "several times; `luxfield reconstruct --sigma` of this version says it."};
  reconstruct::KeptMoments kept;
  const auto& grid = sigma.geometry.grid;
  if (std::sscanf(text("kept_moments").c_str(), "%d %d", &kept.u, &kept.v) != 2 || kept.u < 0 ||
      kept.v < 0 || kept.u > reconstruct::kMostMoments || kept.v > reconstruct::kMostMoments)
    throw InputError(file,
                     fmt::format("luxfield:provenance.kept_moments = '{}' is no pair of numbers "
                                 "from 0 to {}",
                                 text("kept_moments"), reconstruct::kMostMoments),
                     "reconstruct again");
  const reconstruct::GramSolver solver(grid, kept);
  Solve found{{solver.u().map, solver.v().map}, std::string(kNoise)};
  found.uncertainty +=
      solve == "gram" ? "."
                      : ". How coefficients hang together is taken as behind ideal filters, which "
                        "the measured or displaced ones are near.";
  return found;
}

}  // namespace

LampNoise ReadLampNoise(const std::string& file) {
  LampNoise noise;
  noise.file = file;
  if (file.empty()) {
    noise.uncertainty =
        "No standard uncertainties: no --sigma was given (`luxfield reconstruct --sigma` writes "
        "it).";
    return noise;
  }
  noise.sigma = lightfield::ReadLightFields(file);
  for (const auto& posed : noise.sigma) {
    Solve solve = SolveOf(posed.field, file);
    noise.uncertainty = solve.uncertainty;
    noise.maps.push_back(std::move(solve.maps));
  }
  return noise;
}

void SetNoise(photometry::Lamp& lamp, const LampNoise& noise) {
  if (!noise.file.empty()) photometry::SetNoise(lamp, noise.sigma, noise.maps, noise.file);
}

}  // namespace luxfield::cli
