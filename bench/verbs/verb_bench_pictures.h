#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBenchPictures(cli::Program& program, CLI::App& benches);

}  // namespace luxfield::bench
