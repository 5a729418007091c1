// luxfield bench error-runs: registered by AddBench.
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchErrorRuns(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
