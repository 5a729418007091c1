// What the capture verbs print.
#pragma once

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/plan/filter_plan.h"
#include "luxfield/capture/plan/geometry_plan.h"
#include "luxfield/capture/plan/glare_plan.h"
#include "luxfield/capture/plan/sensor_plan.h"
#include "luxfield/core/json.h"
#include "luxfield/hal/devices.h"

namespace luxfield::cli {

// Prints positions, exposure ladder, duration, stage path and bytes; returns them for --json.
core::Json PrintDryRun(const capture::ExpandedPlan& expanded, const hal::Devices& devices);

core::Json PrintDryRun(const capture::ExpandedSensorPlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedGeometryPlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedGlarePlan& expanded, const hal::Devices& devices);
core::Json PrintDryRun(const capture::ExpandedFilterPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::cli
