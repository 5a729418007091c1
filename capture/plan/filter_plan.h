// plan.toml of kind "filter": the photographs of a printed filter in its holder, without the
// luminaire, that `filter measure` turns into its transmittance (docs/formats/lab-and-plan.md).
#pragma once

#include <string>
#include <vector>

#include "luxfield/capture/plan/target_plan.h"
#include "luxfield/rig/filter_sheet.h"

namespace luxfield::capture {

// The holder before an even light, empty and then with every print in it.
struct FilterPlan : TargetPlan {  // whose exposures are those of the empty holder
  int exposures = 3;              // of a print, each 8 times the one before
  int repeats = 4;                // frames of each exposure, and darks
};

// Throws InputError naming file and field.
FilterPlan ReadFilterPlan(const core::Config& config);

struct ExpandedFilterPlan {
  FilterPlan plan;
  std::vector<double> ladder_s;  // rising, in factors of 2
  std::vector<std::string>
      views;               // "filter holder", then "filter print", or "... plus", "... minus"
  rig::FilterSheet sheet;  // of the lab's filter
};

// Throws InputError for a lab that has no bench for its filter, or a colour mosaic, and for
// exposures beyond the camera's.
ExpandedFilterPlan ExpandPlan(const FilterPlan& plan, const hal::Devices& devices);

session::PlanFile ToPlanFile(const ExpandedFilterPlan& expanded);

struct FilterCaptureEstimate {
  int frames = 0, darks = 0;
  double duration_s = 0;  // at most, without handling of the prints
  std::uint64_t bytes = 0;
};
FilterCaptureEstimate DryRun(const ExpandedFilterPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
