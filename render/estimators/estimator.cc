#include "render/estimators/estimator.h"

#include <fmt/format.h>

#include "core/error.h"
#include "render/estimators/exact.h"
#include "render/estimators/windowed.h"

namespace luxfield::render {

std::unique_ptr<Estimator> MakeEstimator(const std::string& name, const Device& device) {
  if (name == ExactTraits().name) return MakeExact(device);
  if (name == WindowedTraits().name) return MakeWindowed(device);
  if (name == ThesisTraits().name) return MakeThesis(device);
  std::string names;
  for (const auto& traits : EstimatorList()) names += (names.empty() ? "" : ", ") + traits.name;
  throw InputError(fmt::format("unknown estimator '{}'; use one of {}", name, names));
}

std::vector<EstimatorTraits> EstimatorList() {
  return {ExactTraits(), WindowedTraits(), ThesisTraits()};
}

}  // namespace luxfield::render
