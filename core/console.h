// What the programs show of an execution on stderr.
#pragma once

#include "luxfield/core/execution.h"

namespace luxfield::core {

// Messages as lines, "luxfield: MESSAGE" and "luxfield: warning: MESSAGE". Progress with an ETA, unless
// `quiet`: on a terminal one line that is redrawn at most ten times a second; elsewhere a line every
// 10 % of jobs that take more than a second.
Execution OnConsole(bool quiet, int threads);

}  // namespace luxfield::core
