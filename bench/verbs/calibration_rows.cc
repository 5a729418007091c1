#include "luxfield/bench/verbs/calibration_rows.h"

#include <algorithm>

namespace luxfield::bench {

core::Json CalibrationRows(std::span<const render::CalibrationRun> runs) {
  core::Json rows = core::Json::array();
  for (const auto& run : runs) {
    const render::LightingWork& work = run.work;
    const double pixels = std::max(work.pixels, 1.0);
    rows.push_back({{"estimator", run.estimator},
                    {"pixels", work.pixels},
                    {"images", work.images / pixels},
                    {"texels", work.texels / pixels},
                    {"spp", work.samples / pixels},
                    {"rays", work.rays / pixels},
                    {"measured_s", run.measured_s},
                    {"predicted_s", run.predicted_s}});
  }
  return rows;
}

}  // namespace luxfield::bench
