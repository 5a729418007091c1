#include "luxfield/reconstruct/calibrate/filter/filter_session.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/reconstruct/bracket/session_views.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::reconstruct {

FilterPhotographs ReadFilterSession(const session::SessionReader& session,
                                    const std::filesystem::path& sensor_calibration,
                                    bool check_hashes,
                                    std::map<std::string, std::string>* provenance) {
  const std::string plan_file = (session.folder() / "plan.json").string(),
                    session_file = (session.folder() / "session.json").string();
  const session::PlanFile plan = session::PlanOf(session);
  if (plan.kind != session::PlanKind::kFilter)
    throw InputError(plan_file, "is no plan of kind \"filter\"",
                     "capture data/plans/filter.toml and give its session");
  FilterPhotographs result;
  result.sheet = session::Stated(plan.sheet, "sheet", plan_file);
  rig::SensorModel sensor = session::SensorModelOf(session);
  if (!sensor.cfa.empty())
    throw InputError(session_file,
                     fmt::format("camera.cfa = '{}': the photograph of a filter of a camera with a "
                                 "colour mosaic is not built",
                                 sensor.cfa),
                     "use the figures that its session states");
  std::map<std::string, std::string> made_of{{"session_plan", session.plan_id()}};
  if (!sensor_calibration.empty())
    made_of["sensor_calibration"] = ApplySensorCalibration(sensor_calibration, sensor);
  sensor.prnu = 0;

  const auto views = FramesByView(session);
  for (int view = 0; view <= result.sheet.prints(); ++view) {
    const auto records = views.find(view);
    if (records == views.end())
      throw InputError(session.folder().string(), fmt::format("has no frame of view {}", view),
                       "resume its capture");
    MergedFrame merged = MergeView(session, records->second, sensor, check_hashes);
    if (view == 0)
      result.light = std::move(merged);
    else
      result.prints.push_back(std::move(merged));
  }
  std::string hashes;
  for (const session::FrameRecord& record : session.frames()) hashes += record.sha256;
  made_of["frames_sha256"] = core::Sha256(hashes);
  if (provenance) provenance->insert(made_of.begin(), made_of.end());
  return result;
}

}  // namespace luxfield::reconstruct
