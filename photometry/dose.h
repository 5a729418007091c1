// The dose of a receiver that moves along a path (asked.h), the integral over time of what it takes in
// (point_receiver.h),
//
//   H = integral E(p(t), n(t)) dt
//
// lx s of a lamp in lm, J/m^2 of one in W. By Gauss-Kronrod rules of 7 and 15 nodes (Piessens et al.,
// QUADPACK, 1983) on stretches that are halved until the two differ by less than 1e-6 of the dose for
// the whole path, or there are 4096 stretches. As all nodes are sums over C, so is the dose, and its variance that of a sum.
#pragma once

#include <vector>

#include "luxfield/photometry/asked.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

struct DoseAnswer {
  PathAsked asked;
  Estimate dose;
  Estimate mean;  // dose over time
  Estimate most;  // of the rate, with the uncertainty of its place
  double most_at_s = 0;
  std::vector<double> time_s, rate;  // at the nodes, in order
};
DoseAnswer DoseAlong(const Lamp& lamp, const PathAsked& asked);

}  // namespace luxfield::photometry
