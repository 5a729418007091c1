// The verb `cache` (cli/verbs/verb_cache.cc).
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::cli {

void AddCache(Program& program);

}  // namespace luxfield::cli
