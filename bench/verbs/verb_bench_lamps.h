// luxfield bench lamps: registered by AddBench.
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchLamps(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
