// With what probability measured values meet limits, from the covariance that sigma(C) makes
// (JCGM 106:2012, 7): of a value y with standard uncertainty u that must not be below L,
//
//   p = Phi((y - L) / u)
//
// and of several at once the share of the joint normal distribution that meets them all.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "luxfield/photometry/functional.h"

namespace luxfield::photometry {

// Covariances of linear functionals of one lamp, which must have noise and outlive this.
class Covariances {
 public:
  explicit Covariances(const Lamp& lamp) : lamp_(lamp) {}

  // The number that it goes by.
  int Add(const Functional& functional);
  double Of(int a, int b) const;

 private:
  const Lamp& lamp_;
  std::vector<Functional> whitened_;  // CoefficientNoise::Whitened
  mutable std::map<std::pair<int, int>, double> known_;
};

// Phi(margin / u); of u = 0, whether the margin is not below 0.
double PassProbability(double margin, double u);

// That all margins are not below 0; covariance(a, b) of two of them, asked for where it matters. Closed form where no
// more than one of them is in doubt (within 6 u); else the share of 40000 draws, whose own standard
// deviation is below 0.0025.
double JointPassProbability(const std::vector<double>& margins,
                            const std::function<double(std::size_t, std::size_t)>& covariance);

}  // namespace luxfield::photometry
