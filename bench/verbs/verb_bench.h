// luxfield bench
#pragma once

#include "luxfield/cli/program.h"
#include "luxfield/cli/verb_list.h"

namespace luxfield::bench {

// As the quick program lists it (cli/quick.h).
inline constexpr cli::VerbName kBenchVerb{"bench", "Measure luxfield itself, or this machine"};

void AddBench(cli::Program& program);

}  // namespace luxfield::bench
