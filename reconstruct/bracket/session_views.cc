#include "reconstruct/session_views.h"

namespace luxfield::reconstruct {
namespace {

DarkFrame DarkOf(const core::SessionReader& session, double exposure_s, bool check_hashes) {
  DarkSum sum(exposure_s);
  for (const core::FrameRecord& record : session.frames())
    if (record.kind == core::FrameKind::kDark && record.exposure_s == exposure_s)
      sum.Add(session.ReadFrame(record, check_hashes));
  return sum.Mean();
}

}  // namespace

std::map<int, std::vector<const core::FrameRecord*>> FramesByView(
    const core::SessionReader& session) {
  std::map<int, std::vector<const core::FrameRecord*>> views;
  for (const core::FrameRecord& record : session.frames())
    if (record.kind == core::FrameKind::kTarget) views[record.i].push_back(&record);
  return views;
}

MergedFrame MergeView(const core::SessionReader& session,
                      const std::vector<const core::FrameRecord*>& records,
                      const SensorModel& sensor, bool check_hashes) {
  std::vector<core::RawFrame> frames;
  std::map<double, DarkFrame> darks;
  for (const core::FrameRecord* record : records) {
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
