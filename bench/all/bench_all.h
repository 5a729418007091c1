// `luxfield bench all`: every figure that has a target, from one command.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/bench/all/work.h"

namespace luxfield::bench {

// {"device", "version", "rows": [{"work", "value", "unit", "target", "ratio_to_target", "peer",
// "peer_value", "limit", "runs", "core_s"}, ...]}, a row for each work:
//
//   value            the median of `runs`, a list; null where the work could not be measured, and
//                    `limit` says why
//   ratio_to_target  value / target, of what should be large (frames, rays a second) target / value:
//                    above 1 where the target is missed
//   peer             another program, or a bound, measured in the same run: peer_value in the same
//                    unit; null where there is none
//   core_s           processor time of a run, all processes, where value is wall time; else null
//
// Times are core-seconds, which other load does not change, but for what a user waits for. Frames a
// second are those that all cores give together: cores over core-seconds of a frame, on GPUs over
// its wall time. Works whose data or programs are missing have their row, too. Throws InputError
// where no work has such a name, Interrupted.
nlohmann::json BenchAll(const AllOptions& options);

// The row of a work that gave these figures.
nlohmann::json RowOf(const Work& work, const Figures& figures);

}  // namespace luxfield::bench
