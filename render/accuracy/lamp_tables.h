// The tables of a lamp that never was a file, as an estimator needs them: what LitScene::Require
// does for scenes.
#pragma once

#include <optional>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

struct LampTables {
  std::optional<preprocess::Tables> sat;
  std::optional<preprocess::CellTables> cells;
  std::optional<preprocess::LightVectorVolume> volume;
  std::optional<preprocess::PatchLight> patches;
  double core_s = 0;  // CPU time of building them

  LuminaireTables view() const {
    return {.sat = sat ? &*sat : nullptr,
            .cells = cells ? &*cells : nullptr,
            .volume = volume ? &*volume : nullptr,
            .patches = patches ? &*patches : nullptr};
  }
};

// For a luminaire at the origin of the G-buffer's world. The volume covers the G-buffer's receivers
// to a relative RMSE of `volume_error`.
LampTables BuildLampTables(const lightfield::LightField& field, const GBuffer& gbuffer,
                           const TableNeeds& needs, double volume_error = 2e-3);

}  // namespace luxfield::render
