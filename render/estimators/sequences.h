// Point sequences that estimators share over all pixels, as tables. Internal to estimators/.
#pragma once

#include <cstdint>
#include <vector>

#include "luxfield/render/device/device.h"
#include "luxfield/render/estimators/knobs.h"

namespace luxfield::render {

// The first `count` points of [0, 1)^2 as 32-bit fractions: Halton's from index 1 on (bases 2, 3);
// Sobol's first two dimensions with a digital shift from `seed`; pairs of MT19937 words seeded by
// it. Digits beyond 32 bits are cut.
std::vector<cl_uint2> MakeSequence(Sequence kind, int count, std::uint64_t seed);

}  // namespace luxfield::render
