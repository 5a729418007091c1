#include "luxfield/reconstruct/bracket/session_views.h"

namespace luxfield::reconstruct {
namespace {

DarkFrame DarkOf(const session::SessionReader& session, double exposure_s, bool check_hashes) {
  DarkSum sum(exposure_s);
  for (const session::FrameRecord& record : session.frames())
    if (record.kind == session::FrameKind::kDark && record.exposure_s == exposure_s)
      sum.Add(session.ReadFrame(record, check_hashes));
  return sum.Mean();
}

}  // namespace

std::map<int, std::vector<const session::FrameRecord*>> FramesByView(
    const session::SessionReader& session) {
  std::map<int, std::vector<const session::FrameRecord*>> views;
  for (const session::FrameRecord& record : session.frames())
    if (record.kind == session::FrameKind::kTarget) views[record.i].push_back(&record);
  return views;
}

MergedFrame MergeView(const session::SessionReader& session,
                      const std::vector<const session::FrameRecord*>& records,
                      const rig::SensorModel& sensor, bool check_hashes) {
  std::vector<session::RawFrame> frames;
  std::map<double, DarkFrame> darks;
  for (const session::FrameRecord* record : records) {
    frames.push_back(session.ReadFrame(*record, check_hashes));
    if (!darks.contains(record->exposure_s))
      darks[record->exposure_s] = DarkOf(session, record->exposure_s, check_hashes);
  }
  std::vector<Exposure> exposures;
  for (std::size_t n = 0; n < records.size(); ++n)
    exposures.push_back({&frames[n], records[n]->exposure_s, records[n]->attenuation, 1,
                         &darks.at(records[n]->exposure_s)});
  return MergeExposures(sensor, exposures);
}

}  // namespace luxfield::reconstruct
