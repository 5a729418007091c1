#include "luxfield/render/accuracy/lamp_tables.h"

#include <string>

#include "luxfield/core/stopwatch.h"
#include "luxfield/render/estimators/volume.h"

namespace luxfield::render {

LampTables BuildLampTables(const lightfield::LightField& field, const GBuffer& gbuffer,
                           const TableNeeds& needs, double volume_error) {
  const core::Stopwatch stopwatch;
  LampTables tables;
  if (needs.sat) tables.sat = preprocess::BuildTables(field, "lamp", std::string(64, '0'));
  if (needs.cells) tables.cells = preprocess::BuildCellTables(field, "lamp");
  if (needs.volume)
    tables.volume = preprocess::BuildForReceivers(field, ReceiversOf(gbuffer, {}),
                                                  {.max_rel_error = volume_error})
                        .volume;
  if (needs.patches) tables.patches = preprocess::TabulatePatchLight(field);
  tables.core_s = stopwatch.CoreSeconds();
  return tables;
}

}  // namespace luxfield::render
