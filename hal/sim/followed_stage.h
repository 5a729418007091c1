// A real stage in a lab that is simulated otherwise.
#pragma once

#include <memory>

#include "luxfield/hal/sim/world.h"
#include "luxfield/hal/stage.h"

namespace luxfield::hal::sim {

// The simulated filter goes where the real stage reads back, and the lab's clock lets the time pass
// that its moves take. Deadlines are on the lab's clock.
std::unique_ptr<Stage> Follow(std::unique_ptr<Stage> real, std::shared_ptr<World> world);

}  // namespace luxfield::hal::sim
