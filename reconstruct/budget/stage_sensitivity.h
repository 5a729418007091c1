// What it does that the rig stands beside the place its read-back states (docs/theory.md 13).
//
// Filter and image move together by e: E is measured behind Phi(u - c - e) at s + e and taken for
// the one at c and s. To first order E changes by e . (dE/dc + dE/ds), dE/dc from the
// reconstructed C (print_sensitivity.h), dE/ds by differences of neighbouring texels: structure
// finer than two texels is smoothed over.
#pragma once

#include <span>

#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/session_plan.h"
#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::reconstruct {

// How Q = sum weights E changes where texel k of the image at position m was taken from
// displacement_m[k] beside its place; and the variance of that from the noise of E, by which its
// square is too large.
struct ImageChange {
  double value = 0, variance = 0;
};
ImageChange ChangeOfImage(const lightfield::Measurements& measurements,
                          const lightfield::Weights& weights, int m,
                          std::span<const lightfield::Vec2> displacement_m);

// sum over texels of weights dE/ds at position m, for Q = sum weights E: dQ per metre that the
// image alone was taken from another place, along s and t, and its variance.
struct ImageSlope {
  lightfield::Vec2 per_m, variance;
};
ImageSlope ImageSensitivity(const lightfield::Measurements& measurements,
                            const lightfield::Weights& weights, int m);

// d log(signal) per metre of a drift reference: its pixels' sum as the reconstructed lamp gives it.
// {} where the lattice shows the reference's pixels no light.
lightfield::Vec2 ReferenceSensitivity(const lightfield::LightField& coefficients,
                                      const SessionPlan& plan, const MergedReference& reference);

}  // namespace luxfield::reconstruct
