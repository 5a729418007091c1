#include "luxfield/render/device/kernel_profile.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "luxfield/render/device/opencl_check.h"

namespace luxfield::render {
namespace {

std::size_t IndexOf(const std::string& kernel, std::vector<KernelTime>& times) {
  const auto at = std::find_if(times.begin(), times.end(),
                               [&](const KernelTime& time) { return time.name == kernel; });
  const auto index = static_cast<std::size_t>(at - times.begin());
  if (index == times.size()) times.push_back({.name = kernel});
  return index;
}

}  // namespace

void AddKernelTime(const KernelTime& time, std::vector<KernelTime>& times) {
  KernelTime& sum = times[IndexOf(time.name, times)];
  sum.launches += time.launches;
  sum.device_s += time.device_s;
}

void to_json(nlohmann::json& json, const KernelTime& time) {
  json = {{"name", time.name}, {"launches", time.launches}, {"device_s", time.device_s}};
}

void KernelProfile::Add(const std::string& kernel, cl_event event) {
  if (pending_.size() >= kMaxPending) Settle(kMaxPending / 2);
  const std::size_t index = IndexOf(kernel, times_);
  ++times_[index].launches;
  Check(clRetainEvent(event), "clRetainEvent");
  pending_.push_back({index, Event(event)});
}

void KernelProfile::Settle(std::size_t keep) {
  for (; pending_.size() > keep; pending_.pop_front())
    times_[pending_.front().kernel].device_s += pending_.front().event.Seconds();
}

std::vector<KernelTime> KernelProfile::Take() {
  Settle(0);
  return std::exchange(times_, {});
}

}  // namespace luxfield::render
