// Device time per kernel, from the events of its launches. Internal to render/.
#pragma once

#include <deque>

#include "luxfield/render/device/device.h"

namespace luxfield::render {

class KernelProfile {
 public:
  // Takes note of a launch just enqueued. Events are read in bunches of old ones, so that their
  // number stays bounded and the queue never runs empty for it.
  void Add(const std::string& kernel, cl_event event);
  std::vector<KernelTime> Take();  // Device::TakeKernelTimes

 private:
  static constexpr std::size_t kMaxPending = 1024;

  struct Launch {
    std::size_t kernel;  // index of times_
    Event event;
  };
  void Settle(std::size_t keep);  // reads all but the newest `keep` launches

  std::deque<Launch> pending_;
  std::vector<KernelTime> times_;
};

}  // namespace luxfield::render
