#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchClassical(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
