// What the capture verbs print.
#pragma once

#include "capture/expanded_plan.h"
#include "capture/filter_plan.h"
#include "capture/geometry_plan.h"
#include "capture/glare_plan.h"
#include "capture/sensor_plan.h"
#include "core/json.h"
#include "hal/devices.h"

namespace luxfield::cli {

// Prints positions, exposure ladder, duration, stage path and bytes; returns them for --json.
core::Json PrintDryRun(const capture::ExpandedPlan& expanded, const hal::Devices& devices);

core::Json PrintDryRun(const capture::ExpandedSensorPlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedGeometryPlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedGlarePlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedFilterPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::cli
