// luxfield bench ray-files: registered by AddBench.
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchRayFiles(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
