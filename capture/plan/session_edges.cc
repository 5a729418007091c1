#include "luxfield/capture/plan/session_edges.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <unordered_map>
#include <vector>

#include "luxfield/core/json.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

using core::Json;
using session::FrameKind;
using session::FrameRecord;

struct Levels {
  double mean_dn = 0, saturated_share = 0;
};

// By file, of the frames whose checks say so by numbers.
std::unordered_map<std::string, Levels> LevelsOfFrames(const session::SessionReader& session) {
  std::unordered_map<std::string, Levels> levels;
  for (const Json& line : session.journal()) {
    if (line.value("type", "") != "frame" || !line.contains("checks")) continue;
    const Json& checks = line.at("checks");
    if (!checks.is_object()) continue;
    const Json mean = checks.value("mean_dn", Json()),
               saturated = checks.value("saturated_share", Json());
    if (mean.is_number() && saturated.is_number())
      levels[line.value("file", "")] = {mean.get<double>(), saturated.get<double>()};
  }
  return levels;
}

}  // namespace

std::optional<SessionEdges> FindSessionEdges(const session::SessionReader& session) {
  constexpr double kBlackSigma_dn = 0.5;
  const session::PlanFile plan = session::PlanOf(session);
  const session::SessionSetup setup = session::SetupOf(session);
  if (plan.kind != session::PlanKind::kLightField || !setup.camera || !setup.camera->black_dn)
    return {};
  const std::string file = (session.folder() / "plan.json").string();
  if (session::Stated(plan.filter, "filter", file).kind == lightfield::FilterKind::kDual) return {};
  const double black_dn = *setup.camera->black_dn;
  SessionEdges edges;
  edges.grid = session::Stated(plan.geometry, "geometry", file).grid;
  const auto levels = LevelsOfFrames(session);

  std::map<double, std::pair<double, int>> darks;  // DN above black summed, and frames
  for (const FrameRecord& record : session.frames())
    if (const auto level = levels.find(record.file);
        record.kind == FrameKind::kDark && level != levels.end()) {
      auto& [sum, frames] = darks[record.exposure_s];
      sum += level->second.mean_dn - black_dn;
      ++frames;
    }
  struct Sums {
    double dn = 0, seconds = 0;
    int frames = 0;
  };
  std::map<std::pair<int, int>, Sums> positions;  // filter and channel
  for (const FrameRecord& record : session.frames()) {
    const auto level = levels.find(record.file);
    if (record.kind != FrameKind::kPosition || level == levels.end() ||
        level->second.saturated_share > 0)
      continue;
    const auto dark = darks.find(record.exposure_s);
    Sums& sums = positions[{edges.grid.index(record.i, record.j), record.channel}];
    sums.dn += level->second.mean_dn - black_dn -
               (dark == darks.end() ? 0 : dark->second.first / dark->second.second);
    sums.seconds += record.exposure_s * record.attenuation;
    ++sums.frames;
  }
  const auto count = static_cast<std::size_t>(edges.grid.count());
  std::vector<double> light(count), variance(count);
  std::vector<bool> seen(count, false);
  for (const auto& [key, sums] : positions) {
    const auto m = static_cast<std::size_t>(key.first);
    if (m >= count || !(sums.seconds > 0)) continue;
    seen[m] = true;
    light[m] += sums.dn / sums.seconds;
    const double sigma = kBlackSigma_dn * sums.frames / sums.seconds;
    variance[m] += sigma * sigma;
  }
  if (std::find(seen.begin(), seen.end(), false) != seen.end()) return {};
  edges.light = lightfield::FindEdgeLight(edges.grid, light, variance);
  return edges;
}

}  // namespace luxfield::capture
