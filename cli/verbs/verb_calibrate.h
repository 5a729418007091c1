// Verbs of the group `calibrate`, a file each; verb_calibrate.cc holds the group and `sensor`.
#pragma once

#include "luxfield/cli/program.h"

namespace luxfield::cli {

void AddCalibrateGeometry(Program& program, CLI::App& group);
void AddCalibrateFlatField(Program& program, CLI::App& group);
void AddCalibrateGlare(Program& program, CLI::App& group);
void AddCalibrateResponse(Program& program, CLI::App& group);

}  // namespace luxfield::cli
