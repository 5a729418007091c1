// Does light reach the outer filters of a session's grid? From the mean levels that the journal
// has of every frame, before anything is merged.
#pragma once

#include <optional>

#include "luxfield/lightfield/edge_light.h"
#include "luxfield/session/session_store.h"

namespace luxfield::capture {

struct SessionEdges {
  lightfield::BasisGrid grid;
  lightfield::EdgeLight light;  // measured_flux is not known: 0
};

// Per position the mean level of its frames without saturated pixels, above black and the darks of
// their exposure time, over the sum of exposure times; channels are added. Black and darks count as
// known to half a DN a frame. Nothing for plans of other kinds, dual filters, sessions without a
// stated black level, and before every position has such a frame.
std::optional<SessionEdges> FindSessionEdges(const session::SessionReader& session);

}  // namespace luxfield::capture
