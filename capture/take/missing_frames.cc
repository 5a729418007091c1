#include "luxfield/capture/take/missing_frames.h"

#include <set>

#include "luxfield/capture/take/capture_filter.h"
#include "luxfield/capture/take/capture_geometry.h"
#include "luxfield/capture/take/capture_glare.h"
#include "luxfield/capture/take/capture_sensor.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

int MissingPositions(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  std::set<std::pair<int, int>> there;
  for (const session::FrameRecord& record : session.frames())
    if (record.kind == session::FrameKind::kPosition) there.insert({record.i, record.j});
  int missing = 0;
  const session::PlanFile plan = session::PlanOf(session);
  for (const session::PlannedPosition& p : session::Stated(plan.positions, "positions", file))
    missing += !there.contains({p.i, p.j});
  return missing;
}

}  // namespace

int MissingFrames(const session::SessionReader& session) {
  switch (session::PlanOf(session).kind) {
    case session::PlanKind::kSensor:
      return MissingSensorFrames(session);
    case session::PlanKind::kGeometry:
      return MissingGeometryFrames(session);
    case session::PlanKind::kGlare:
      return MissingGlareFrames(session);
    case session::PlanKind::kFilter:
      return MissingFilterFrames(session);
    case session::PlanKind::kLightField:
      break;
  }
  return MissingPositions(session);
}

}  // namespace luxfield::capture
