// luxfield bench
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::bench {

void AddBench(cli::Program& program);

}  // namespace luxfield::bench
