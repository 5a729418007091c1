#include "luxfield/hal/transport/controller_stage.h"

#include <fmt/format.h>

namespace luxfield::hal {
namespace {

constexpr double kAnswer_s = 2;   // for a position; a slow line takes one
constexpr double kStop_s = 0.02;  // to hand a stop over: its callers have more to switch off

}  // namespace

ControllerStage::ControllerStage(const StageLimits& limits, std::shared_ptr<core::Clock> clock)
    : limits_(limits), clock_(std::move(clock)) {}

HardwareError ControllerStage::Failure(const Operation& operation, Fault fault,
                                       const std::string& problem, const std::string& remedy,
                                       bool lost) const {
  HardwareError error(fault, identity(), operation.name, problem, remedy);
  error.position_lost = lost;
  return error;
}

void ControllerStage::Guarded(const Operation& operation, const std::function<void()>& work) {
  try {
    work();
  } catch (HardwareError& error) {
    const bool was_homing = homing_.exchange(false);
    if (error.fault == Fault::kStopped) stop_requested_ = false;  // it has been told
    if (error.fault == Fault::kStopped && !error.position_lost) throw;
    error.position_lost = true;
    LosePosition(error.problem);
    suspect_ = true;
    try {
      SendStop(was_homing, operation.deadline);
    } catch (const HardwareError&) {  // it cannot be told more than it could be asked
    }
    throw;
  }
}

void ControllerStage::Restore(const Operation& operation) {
  Halt(operation);
  suspect_ = false;
}

void ControllerStage::Connect(double within_s, const std::function<void(const Operation&)>& work) {
  const Operation restore{"connect", SecondsFromNow(within_s)};
  Guarded(restore, [&] { Restore(restore); });
  const Operation connect{"connect", SecondsFromNow(2 * within_s)};
  Guarded(connect, [&] { work(connect); });
}

void ControllerStage::ThrowIfStopped(const Operation& operation) {
  if (!stop_requested_.exchange(false)) return;
  const bool known = Known().homed && !suspect_ && !homing_;
  const bool kept = Halt(operation) && known;
  SetHomed(kept);
  throw Failure(operation, Fault::kStopped, "stopped on request",
                kept ? "move it again when it is safe" : "home it when it is safe", !kept);
}

void ControllerStage::Home(double deadline_s) {
  const std::lock_guard turn(turn_);
  const Operation home{"home", OnSteadyClock(deadline_s, *clock_)};
  Guarded(home, [&] {
    ThrowIfStopped(home);
    SetHomed(false);
    if (suspect_) Restore(home);
    homing_ = true;
    DriveHome(home);
    homing_ = false;
    SetHomed(true);
    const std::lock_guard lock(known_mutex_);
    known_.setpoint = known_.readback;
  });
}

void ControllerStage::MoveTo(Vec2 centre, double deadline_s) {
  const std::lock_guard turn(turn_);
  const Operation move{"move", OnSteadyClock(deadline_s, *clock_)};
  if (!Known().homed)
    throw Failure(move, Fault::kNotHomed, "it does not know where it is", "home it first", true);
  if (!limits_.Contain(centre))
    throw Failure(move, Fault::kOutOfRange,
                  fmt::format("({}, {}) m is outside [{}, {}] x [{}, {}]", centre.x, centre.y,
                              limits_.min.x, limits_.max.x, limits_.min.y, limits_.max.y),
                  "choose a smaller grid or another stage");
  Guarded(move, [&] {
    ThrowIfStopped(move);
    {
      const std::lock_guard lock(known_mutex_);
      known_.setpoint = centre;
    }
    DriveTo(move, centre);
    if (clock_->MonotonicSeconds() + limits_.settle_s > deadline_s)
      throw Failure(move, Fault::kTimeout, "arrived without the time left to settle",
                    "allow more time");
    clock_->SleepSeconds(limits_.settle_s);
  });
}

StagePosition ControllerStage::Where() {
  if (const std::unique_lock turn(turn_, std::try_to_lock); turn && !suspect_) {
    const Operation read{"read position", SecondsFromNow(kAnswer_s)};
    try {
      Guarded(read, [&] { AskPosition(read); });
    } catch (const HardwareError& error) {  // Known() has its reason
      if (error.fault == Fault::kTimeout || error.fault == Fault::kDisconnected) throw;
    }
  }
  return Known();
}

void ControllerStage::Stop() {
  stop_requested_ = true;
  SendStop(homing_, SecondsFromNow(kStop_s));
}

void ControllerStage::Heard(Vec2 readback, bool moving) {
  const std::lock_guard lock(known_mutex_);
  known_.readback = readback;
  known_.moving = moving;
}

StagePosition ControllerStage::Known() const {
  const std::lock_guard lock(known_mutex_);
  return known_;
}

void ControllerStage::SetHomed(bool homed) {
  const std::lock_guard lock(known_mutex_);
  known_.homed = homed;
  if (homed) known_.lost.clear();
}

// The first cause counts: what follows it are its consequences.
void ControllerStage::LosePosition(const std::string& why) {
  const std::lock_guard lock(known_mutex_);
  known_.homed = false;
  if (known_.lost.empty()) known_.lost = why;
}

}  // namespace luxfield::hal
