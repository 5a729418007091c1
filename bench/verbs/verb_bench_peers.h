// luxfield bench peers: registered by AddBench.
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchPeers(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
