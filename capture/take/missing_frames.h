// What a session lacks of its plan.
#pragma once

#include "luxfield/session/session_store.h"

namespace luxfield::capture {

// Planned positions without a whole bracket; of plans of other kinds, planned frames that are not
// there.
int MissingFrames(const session::SessionReader& session);

}  // namespace luxfield::capture
