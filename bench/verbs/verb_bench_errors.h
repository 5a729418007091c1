#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

// Benches of errors that pictures and tables state against those that they have.
void AddBenchStatedErrors(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
