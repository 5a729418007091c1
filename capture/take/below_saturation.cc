#include "luxfield/capture/take/below_saturation.h"

#include <fmt/format.h>

#include "luxfield/core/error.h"

namespace luxfield::capture {

Shot ShootBelowSaturation(FrameTaker& taker, const std::vector<double>& ladder_s,
                          double saturation_share, const rig::SensorModel& camera,
                          const std::string& plan, const std::string& what,
                          session::FrameRecord& record) {
  const double range = camera.saturation_dn - camera.black_dn;
  for (int rung = static_cast<int>(ladder_s.size()) - 1; rung >= 0; --rung) {
    taker.Configure(rung);
    record.exposure_index = rung;
    Shot shot = taker.Shoot(record);
    const double share = (shot.statistics.brightest_dn - camera.black_dn) / range;
    if (share > saturation_share) continue;
    constexpr double kLeast = 0.1;
    if (share < kLeast)
      throw InputError(fmt::format("plan \"{}\"", plan),
                       fmt::format("{} shows {:.2g} of the sensor's range in {} s", what, share,
                                   taker.exposure_s()),
                       "raise the light, or exposure.max_s");
    return shot;
  }
  throw InputError(fmt::format("plan \"{}\"", plan),
                   fmt::format("{} is too bright even at {} s", what, ladder_s.front()),
                   "dim the light, or lower exposure.min_s");
}

}  // namespace luxfield::capture
