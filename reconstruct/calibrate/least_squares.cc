#include "luxfield/reconstruct/calibrate/least_squares.h"

#include <glog/logging.h>

namespace luxfield::reconstruct {

ceres::TerminationType SolveLeastSquares(ceres::Solver::Options options, ceres::Problem* problem) {
  // Ceres warns through glog of every step that it has to shorten, whatever logging_type says.
  // Nothing else here logs through glog.
  [[maybe_unused]] static const int least_level = FLAGS_minloglevel = google::GLOG_FATAL;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  return summary.termination_type;
}

}  // namespace luxfield::reconstruct
