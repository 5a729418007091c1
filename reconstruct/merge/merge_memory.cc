#include "luxfield/reconstruct/merge/merge_memory.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "luxfield/reconstruct/bracket/session_plan.h"

namespace luxfield::reconstruct {
namespace {

using session::FrameKind;
using session::FrameRecord;

constexpr std::uint64_t kBesidePlanes = std::uint64_t{32} << 20;  // the journal, tiles of threads

struct FrameCounts {
  std::uint64_t bytes = 0;           // of a frame's file, which holds its samples as they are
  std::uint64_t bracket = 0;         // frames of the longest
  std::uint64_t dark_exposures = 0;  // exposure times of dark frames
};

FrameCounts Count(const session::SessionReader& session) {
  std::map<std::tuple<int, int, int, int>, std::uint64_t> brackets;
  std::set<double> darks;
  FrameCounts counts;
  for (const FrameRecord& record : session.frames()) {
    std::error_code missing;  // the merge says which
    const auto bytes = std::filesystem::file_size(session.folder() / record.file, missing);
    if (!missing) counts.bytes = std::max<std::uint64_t>(counts.bytes, bytes);
    if (record.kind == FrameKind::kDark) darks.insert(record.exposure_s);
    if (record.kind == FrameKind::kPosition)
      counts.bracket =
          std::max(counts.bracket, ++brackets[{record.i, record.j, record.print, record.channel}]);
  }
  counts.dark_exposures = darks.size();
  return counts;
}

// Whether registration keeps where the corners of pixels lie on I.
bool KeepsCorners(const SessionPlan& plan) {
  const rig::Homography& m = plan.image_from_sensor;
  return plan.lens || m(0, 1) != 0 || m(1, 0) != 0 || m(2, 0) != 0 || m(2, 1) != 0;
}

}  // namespace

std::uint64_t MergeBytes(const session::SessionReader& session,
                         const MergeSessionOptions& options) {
  constexpr std::uint64_t kDark = sizeof(float), kMerged = 16, kCorner = 16, kSum = 8,
                          kDarksAtOnce = 4;
  const SessionPlan plan = CalibratedPlan(session, options);
  const FrameCounts counts = Count(session);
  const std::uint64_t pixels = static_cast<std::uint64_t>(plan.sensor.width) * plan.sensor.height,
                      texels = plan.geometry.plane_size(),
                      channels = static_cast<std::uint64_t>(plan.geometry.channels);
  const bool mosaic = !plan.sensor.cfa.empty();
  std::uint64_t kept = kDark * counts.dark_exposures;  // bytes a pixel, from the darks on
  if (!plan.sensor.vignetting.empty()) kept += 4 * (1 + channels * (mosaic ? 2 : 1));
  if (KeepsCorners(plan)) kept += kCorner * (mosaic ? 2 : 1);
  const std::uint64_t dark = pixels * kSum + 3 * kDarksAtOnce * counts.bytes,
                      merging = pixels * (kMerged + (mosaic ? kMerged / 4 : 0)) +
                                3 * counts.bracket * counts.bytes;
  // Of a texel: what one bracket is registered to, sums in double precision, and the position.
  const std::uint64_t registered = 16 + 16 * channels + 8 * channels + 8;
  return pixels * kept + std::max(dark, merging + texels * registered) + kBesidePlanes;
}

}  // namespace luxfield::reconstruct
