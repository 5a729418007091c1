// out/demo/: pictures, lamp.html, report.html and summary.json of a demo run.
#pragma once

#include <filesystem>

#include "luxfield/core/json.h"
#include "luxfield/planning/demo.h"

namespace luxfield::cli {

// Writes the PNGs, lamp.html, report.html and summary.json beside the run's files and returns the
// summary.
core::Json WriteDemoReport(const std::filesystem::path& folder, const planning::DemoResult& result);

}  // namespace luxfield::cli
