#pragma once

#include "cli/program.h"

namespace luxfield::cli {

void AddBenchCapture(Program& program, CLI::App& benches);

}  // namespace luxfield::cli
