// Would the light of a simulated lab's lamp reach the outer filters of a plan?
#pragma once

#include <filesystem>
#include <optional>

#include "luxfield/lightfield/edge_light.h"

namespace luxfield::planning {

// From samples of the lamp's light over the plan's lattice, coarsely. Nothing where it is not
// known: labs with devices, whose lamp nobody states, and dual filters. Throws InputError as
// hal::sim::ReadLab does.
std::optional<lightfield::EdgeLight> PlannedEdgeLight(const std::filesystem::path& lab_toml,
                                                      const lightfield::LuminaireGeometry& geometry,
                                                      bool dual);

}  // namespace luxfield::planning
