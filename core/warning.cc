#include "luxfield/core/warning.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/execution.h"

namespace luxfield::core {

void Warn(const std::string& message) { Say(Severity::kWarning, message); }

void SuspectLength(const std::string& file, const std::string& field, double value_m,
                   double most_m) {
  if (std::abs(value_m) > most_m)
    Warn(fmt::format("{}: {} = {:g} m is beyond the {:g} m that are usual; is it in metres?", file,
                     field, value_m, most_m));
}

}  // namespace luxfield::core
