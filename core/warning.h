// What a person should know although it stops nothing.
#pragma once

#include <string>

namespace luxfield::core {

// To the execution that hears of it, once (execution.h). Thread-safe.
void Warn(const std::string& message);

// Warns, naming file, field and value, of a length or coordinate beyond `most_m`: one given in
// millimetres, as it seems.
void SuspectLength(const std::string& file, const std::string& field, double value_m,
                   double most_m);

}  // namespace luxfield::core
