#include "luxfield/reconstruct/bracket/mosaic_sites.h"

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::reconstruct {
int SitesOf(const std::string& cfa) { return cfa.empty() ? 1 : 4; }

int ChannelOfPixel(const rig::SensorModel& sensor, std::size_t k) {
  return rig::CfaChannel(sensor.cfa, static_cast<int>(k) / sensor.width,
                         static_cast<int>(k) % sensor.width);
}

MergedFrame PixelsOfSite(const MergedFrame& merged, int site) {
  const int width = merged.width, height = merged.height;
  const auto own = [&](const auto& plane) { return PixelsOfSite(plane, width, height, site); };
  return {(width + 1 - site % 2) / 2, (height + 1 - site / 2) / 2, own(merged.rate_e_per_s),
          own(merged.sigma_e_per_s),  own(merged.count),           own(merged.mask)};
}

std::vector<session::RawFrame> SplitSites(session::RawFrame frame, const std::string& cfa) {
  std::vector<session::RawFrame> sites;
  if (cfa.empty()) {
    sites.push_back(std::move(frame));
    return sites;
  }
  const int width = frame.width, height = frame.height;
  for (int site = 0; site < SitesOf(cfa); ++site)
    sites.push_back({(width + 1 - site % 2) / 2, (height + 1 - site / 2) / 2,
                     PixelsOfSite(frame.dn, width, height, site),
                     PixelsOfSite(frame.value, width, height, site)});
  return sites;
}

}  // namespace luxfield::reconstruct
