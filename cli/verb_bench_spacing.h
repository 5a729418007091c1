#pragma once

#include "cli/program.h"

namespace luxfield::cli {

void AddBenchSpacing(Program& program, CLI::App& benches);

}  // namespace luxfield::cli
