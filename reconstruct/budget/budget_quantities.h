// What an error budget is asked for (error_budget.h), as linear forms in the coefficients.
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/reconstruct/budget/basis_truncation.h"
#include "luxfield/reconstruct/budget/error_budget.h"

namespace luxfield::reconstruct {

struct AskedQuantity {
  std::string name, unit;
  double value = 0;
  lightfield::Weights weights;  // of the coefficients
  std::vector<Term> terms;      // the same of any grid's coefficients (basis_truncation.h)
  double per_delta = 0;         // dQ per metre of the plane distance, coefficients as they are
};

// The flux, then rays, then receivers; without either the radiance at the largest coefficient and
// the irradiance on the axis 1 m and 10 m before I.
std::vector<AskedQuantity> AskQuantities(const lightfield::LightField& field,
                                         BudgetSettings settings);

// Multiplies all quantities by the factor the meter asks for, as linear forms: what factor and
// quantity have in common cancels.
struct ScaledByMeter {
  AskedQuantity factor;  // its weights are those of its own error
  double meter_relative = 0;
  MeterScale scale;
};
// Throws InputError for a reading where the field shows no light.
ScaledByMeter ScaleByMeter(const lightfield::LightField& field, const Meter& meter,
                           std::vector<AskedQuantity>* quantities);

}  // namespace luxfield::reconstruct
