// luxfield view
#pragma once

#include "luxfield/cli/program.h"
#include "luxfield/cli/verb_list.h"

namespace luxfield::view {

// As the quick program lists it (cli/quick.h).
inline constexpr cli::VerbName kViewVerb{
    "view",
    "Look at a scene, a light field, a picture or a session in a window: move, read values"};

void AddView(cli::Program& program);

}  // namespace luxfield::view
