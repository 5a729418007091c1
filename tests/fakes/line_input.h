// A wire to input Line0 of aravis' own camera, which takes that for a trigger's source and has no
// line: what its server asks before a frame is answered here, where a program is linked with this.
#pragma once

#include <arv.h>

namespace luxfield::fakes {

// A rising edge at Line0. A camera that acquires, its frames triggered by that input, exposes one
// frame; any other, and one that has the last edge still to serve, does nothing (false).
bool RaiseLine0(ArvFakeCamera* camera);

}  // namespace luxfield::fakes
