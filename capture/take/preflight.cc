#include "luxfield/capture/take/preflight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <deque>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/warning.h"
#include "luxfield/hal/safety/watchdog.h"

namespace luxfield::capture {

double Deadline(hal::Devices& devices, double duration_s) {
  constexpr double kMargin_s = 10;
  const double within_s = 1.5 * duration_s + kMargin_s;
  if (devices.watchdog) devices.watchdog->Expect(within_s);
  return devices.clock->MonotonicSeconds() + within_s;
}

void Sleep(hal::Devices& devices, double duration_s) {
  Deadline(devices, duration_s);
  devices.clock->SleepSeconds(duration_s);
}

void SwitchLampOff(hal::Devices& devices) {
  if (devices.supply) devices.supply->SetOutput(false, Deadline(devices, 1));
  if (devices.watchdog) devices.watchdog->Expect(hal::Watchdog::kUnbounded_s);
}

double ClockOffset(core::Clock& clock) {
  const std::string utc = clock.UtcIso8601();
  const double monotonic_s = clock.MonotonicSeconds();
  std::tm time{};
  double seconds = 0;
  if (std::sscanf(utc.c_str(), "%d-%d-%dT%d:%d:%lf", &time.tm_year, &time.tm_mon, &time.tm_mday,
                  &time.tm_hour, &time.tm_min, &seconds) != 6 ||
      time.tm_year < 2000)
    throw DeviceError(fmt::format(
        "the computer's clock says {}: nobody has set it, and the session's records would be dated "
        "by it; set the time and start again",
        utc));
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  return static_cast<double>(timegm(&time)) + seconds - monotonic_s;
}

std::string FreeAndNeeded(std::uint64_t free, std::uint64_t needed) {
  constexpr std::uint64_t kMib = 1 << 20;
  return fmt::format("{} MiB are free, the capture may need {} MiB", free / kMib,
                     needed / kMib + (needed % kMib > 0));
}

void CheckDiskAndSafety(std::uint64_t bytes, hal::Devices& devices,
                        const std::filesystem::path& folder) {
  // The folder may not exist yet: ask its nearest ancestor.
  std::filesystem::path existing = std::filesystem::absolute(folder);
  while (!std::filesystem::exists(existing) && existing.has_relative_path())
    existing = existing.parent_path();
  const auto free = std::filesystem::space(existing).available;
  const auto needed = static_cast<std::uint64_t>(1.3 * static_cast<double>(bytes));
  if (free < needed)
    throw DeviceError(fmt::format("{}: {}; free space or choose another disk", folder.string(),
                                  FreeAndNeeded(free, needed)));
  if (!devices.inputs) return;
  if (const hal::InputState state = devices.inputs->State(); !state.safe())
    throw DeviceError(fmt::format("{}: {}; clear it and start again", devices.inputs->identity(),
                                  hal::Describe(state)));
  if (!devices.inputs->real_time() || (devices.watchdog && !devices.watchdog->real_time()))
    core::Warn(fmt::format(
        "{}: the system refuses real-time priority; on a busy machine an emergency stop took 28 ms "
        "without it and 3 ms with it; write \"NAME - rtprio 20\", with your user name for NAME, "
        "into /etc/security/limits.d/luxfield.conf and log in again",
        devices.inputs->identity()));
}

WarmUp WaitForLamp(const WarmUpPolicy& policy, hal::Devices& devices, hal::SafetyGuard& guard) {
  if (devices.supply) {
    const hal::SupplyState state = guard.SwitchLampOn(Deadline(devices, 1));
    if (!state.output)
      throw DeviceError(
          fmt::format("{}: stays off; check its fuse and interlock", devices.supply->identity()));
  }
  const double start = devices.clock->MonotonicSeconds();
  WarmUp result;
  if (!devices.monitor) {
    Sleep(devices, policy.window_s);
    return {policy.window_s, 0, 0};
  }
  std::deque<hal::Reading> window;
  for (;;) {
    const hal::Reading reading = devices.monitor->Read(Deadline(devices, 1));
    guard.ThrowIfUnsafe();  // before the reading is judged: the lamp may just have gone off
    if (reading.over_range || !(reading.value > 0))
      throw DeviceError(fmt::format("{}: reads {} {}; check the lamp and the monitor's range",
                                    devices.monitor->identity(), reading.value, reading.unit));
    window.push_back(reading);
    while (window.size() > 1 && window[1].t_s <= reading.t_s - policy.window_s) window.pop_front();
    const auto [least, most] =
        std::minmax_element(window.begin(), window.end(),
                            [](const auto& a, const auto& b) { return a.value < b.value; });
    double sum = 0;
    for (const auto& r : window) sum += r.value;
    result.variation = (most->value - least->value) * static_cast<double>(window.size()) / sum;
    result.meter = reading.value;
    result.waited_s = devices.clock->MonotonicSeconds() - start;
    const bool full = reading.t_s - window.front().t_s >= policy.window_s;
    if (full && result.variation <= policy.variation) return result;
    if (result.waited_s > policy.max_wait_s)
      throw DeviceError(fmt::format(
          "{}: the lamp still varies by {:.2g} over {} s after {}; check its supply, or raise "
          "warm_up.variation or max_wait_s in the plan",
          devices.monitor->identity(), result.variation, policy.window_s,
          core::FormatDuration(result.waited_s)));
    core::ThrowIfInterrupted();
    Sleep(devices, policy.interval_s);
  }
}

}  // namespace luxfield::capture
