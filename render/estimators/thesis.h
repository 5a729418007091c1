// The estimator as the thesis prints it (4.5 to 4.18), kept as a baseline, with its knobs
// (knobs.h). Biased: its marginal is restricted in one axis only (24 to 40 % rms on rings, facets,
// filaments); with rounded allocation images with A_m K < A / 2 are dropped (1 to 4 % of the energy
// at K = 200, up to 12 % at K = 100); and one shared Halton prefix for all images puts few samples
// near the windows' centres (up to +69 % at K = 200 on 99 images). All in docs/theory.md 6.
#pragma once

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& ThesisTraits();
std::unique_ptr<Estimator> MakeThesis(const Device& device);

}  // namespace luxfield::render
