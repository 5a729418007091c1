// Samplers of windowed summed-area tables (THEORY.md 6).
//
// `windowed` draws images in proportion to their windows' mass by systematic allocation, and points
// with density C / mass exactly: the marginal is restricted in both axes. Unbiased; every
// contribution is at most A / K times the largest Phi (n . (u - p))+ of the luminaire.
//
// `thesis` is the estimator as printed (4.5 to 4.18), kept as a baseline. Biased: its marginal is
// restricted in one axis only (24 to 40 % rms on rings, facets, filaments), images with A_m K < A /
// 2 are dropped (1 to 4 % of the energy at K = 200, up to 12 % at K = 100), and one Halton prefix
// for all images puts few samples near the windows' centres (up to +69 % at K = 200 on 99 images).
// All in THEORY.md 6.
#pragma once

#include "render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& WindowedTraits();
std::unique_ptr<Estimator> MakeWindowed(const Device& device);

const EstimatorTraits& ThesisTraits();
std::unique_ptr<Estimator> MakeThesis(const Device& device);

}  // namespace luxfield::render
