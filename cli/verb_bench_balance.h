#pragma once

#include "cli/program.h"

namespace luxfield::cli {

void AddBenchBalance(Program& program, CLI::App& benches);

}  // namespace luxfield::cli
