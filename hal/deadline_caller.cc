#include "luxfield/hal/deadline_caller.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/hal/error.h"

namespace luxfield::hal {

DeadlineCaller::DeadlineCaller(std::string device, std::shared_ptr<core::Clock> clock)
    : device_(std::move(device)),
      clock_(std::move(clock)),
      thread_([shared = shared_] { Run(shared); }) {}

DeadlineCaller::~DeadlineCaller() {
  bool busy = false;
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->end = true;
    busy = !shared_->busy_with.empty();
  }
  shared_->changed.notify_all();
  if (busy)
    thread_.detach();
  else
    thread_.join();
}

void DeadlineCaller::Run(const std::shared_ptr<Shared>& shared) {
  std::unique_lock lock(shared->mutex);
  for (;;) {
    shared->changed.wait(lock, [&] { return shared->job || shared->end; });
    if (!shared->job) return;
    std::function<Deliver()> job = std::exchange(shared->job, nullptr);
    lock.unlock();
    const Deliver deliver = job();
    job = nullptr;
    lock.lock();
    shared->busy_with.clear();
    lock.unlock();
    deliver();
    lock.lock();
  }
}

void DeadlineCaller::Start(const std::string& operation, std::function<Deliver()> job) {
  {
    const std::lock_guard lock(shared_->mutex);
    if (!shared_->busy_with.empty())
      throw HardwareError(Fault::kTimeout, device_, operation,
                          fmt::format("still hangs in \"{}\"", shared_->busy_with),
                          "power-cycle the device, then resume");
    shared_->busy_with = operation;
    shared_->job = std::move(job);
  }
  shared_->changed.notify_all();
}

std::chrono::duration<double> DeadlineCaller::TimeTo(double deadline_s) const {
  return std::chrono::duration<double>(std::max(deadline_s - clock_->MonotonicSeconds(), 0.0));
}

void DeadlineCaller::GiveUp(const std::string& operation) const {
  throw HardwareError(Fault::kTimeout, device_, operation, "has not ended by its deadline",
                      "check power and cable, then resume");
}

}  // namespace luxfield::hal
