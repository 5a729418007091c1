#pragma once

#include "cli/program.h"

namespace luxfield::cli {

// Benches of errors that pictures and tables state against those that they have.
void AddBenchStatedErrors(Program& program, CLI::App& benches);

}  // namespace luxfield::cli
