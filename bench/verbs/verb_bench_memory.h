// luxfield bench memory
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchMemory(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
