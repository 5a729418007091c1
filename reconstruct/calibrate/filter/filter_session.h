// A session of kind "filter" -> the photographs that MeasureFilter takes.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/filter_sheet.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

struct FilterPhotographs {
  rig::FilterSheet sheet;
  MergedFrame light;
  std::vector<MergedFrame> prints;  // 1, or plus and minus
};

// Merged with the sensor's noise as session.json or a sensor's *.cal.json (if not empty) has it;
// PRNU and vignetting cancel in the ratio of two photographs. `provenance`, if given, gets plan id
// and hashes. Throws InputError for a session of another kind, one that lacks a view, and a camera
// with a colour mosaic.
FilterPhotographs ReadFilterSession(const session::SessionReader& session,
                                    const std::filesystem::path& sensor_calibration,
                                    bool check_hashes = true,
                                    std::map<std::string, std::string>* provenance = nullptr);

}  // namespace luxfield::reconstruct
