#include "luxfield/hal/drivers/aravis/device_clock.h"

#include <algorithm>

namespace luxfield::hal::aravis {

double DeviceClock::StartOf(std::uint64_t stamp_ns, double sent_s, double latest_s) {
  // Some way into what is possible: the next trigger may be quicker, and the clocks drift by some
  // 50 us in a second, at worst.
  constexpr double kTrigger_s = 2e-3, kNs = 1e-9;
  latest_s = std::max(sent_s, latest_s);
  if (stamp_ns == 0) return sent_s;
  if (anchor_ns_ > 0) {
    const auto since_ns = static_cast<std::int64_t>(stamp_ns - anchor_ns_);
    const double start_s = anchor_s_ + kNs * static_cast<double>(since_ns);
    if (start_s >= sent_s && start_s <= latest_s) return start_s;
  }
  anchor_ns_ = stamp_ns;
  anchor_s_ = sent_s + std::min(kTrigger_s, 0.5 * (latest_s - sent_s));
  return anchor_s_;
}

}  // namespace luxfield::hal::aravis
