#include "luxfield/capture/take/missing_frames.h"

#include <set>

#include "luxfield/capture/take/capture_filter.h"
#include "luxfield/capture/take/capture_geometry.h"
#include "luxfield/capture/take/capture_glare.h"
#include "luxfield/capture/take/capture_sensor.h"
#include "luxfield/core/json.h"

namespace luxfield::capture {
namespace {

int MissingPositions(const session::SessionReader& session) {
  const std::string file = (session.folder() / "plan.json").string();
  std::set<std::pair<int, int>> there;
  for (const session::FrameRecord& record : session.frames())
    if (record.kind == session::FrameKind::kPosition) there.insert({record.i, record.j});
  int missing = 0;
  for (const core::Json& p : core::Field<core::Json>(session.plan(), "positions", file))
    missing += !there.contains({core::Field<int>(p, "i", file), core::Field<int>(p, "j", file)});
  return missing;
}

}  // namespace

int MissingFrames(const session::SessionReader& session) {
  const core::Json& plan = session.plan();
  const std::string kind =
      plan.contains("kind")
          ? core::Field<std::string>(plan, "kind", (session.folder() / "plan.json").string())
          : "light-field";
  if (kind == "sensor") return MissingSensorFrames(session);
  if (kind == "geometry") return MissingGeometryFrames(session);
  if (kind == "glare") return MissingGlareFrames(session);
  if (kind == "filter") return MissingFilterFrames(session);
  return MissingPositions(session);
}

}  // namespace luxfield::capture
