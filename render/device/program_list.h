// Every program that the renderer builds, by its options: those that compilers of devices which are
// not here are tried with (tests/offline/). Program::Build takes no other.
#pragma once

#include <vector>

#include "luxfield/render/device/program_cache.h"

namespace luxfield::render {

// Those of a file follow each other; the last has most code.
const std::vector<ProgramName>& AllPrograms();

// std::logic_error if it is none of them. Blanks between options do not count.
void RequireListed(const ProgramName& name);

}  // namespace luxfield::render
