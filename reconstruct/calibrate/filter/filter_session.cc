#include "luxfield/reconstruct/calibrate/filter/filter_session.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/reconstruct/bracket/session_views.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"

namespace luxfield::reconstruct {

using core::Field;
using core::Json;

FilterPhotographs ReadFilterSession(const session::SessionReader& session,
                                    const std::filesystem::path& sensor_calibration,
                                    bool check_hashes,
                                    std::map<std::string, std::string>* provenance) {
  const std::string plan_file = (session.folder() / "plan.json").string(),
                    session_file = (session.folder() / "session.json").string();
  if (core::FieldOr<std::string>(session.plan(), "kind", "light-field", plan_file) != "filter")
    throw InputError(plan_file, "is no plan of kind \"filter\"",
                     "capture data/plans/filter.toml and give its session");
  FilterPhotographs result;
  result.sheet =
      rig::ParseFilterSheet(Field<Json>(session.plan(), "sheet", plan_file).dump(), plan_file);
  const auto camera = Field<Json>(session.session(), "camera", session_file);
  RefuseMosaic(camera, session_file, "the photograph of a filter");
  const auto channels =
      static_cast<int>(Field<Json>(camera, "responsivity_e_per_s_per_w_m2", session_file).size());
  SensorModel sensor = ReadSensorModel(camera, session_file, session.folder(), channels);
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
