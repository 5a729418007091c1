// The rules of hal::Stage, once for all stages that a controller moves. A driver adds the
// conversation with its controller, as six functions (docs/adding-a-driver.md).
//
// - One thread at a time drives; Where() and Stop() are free to others.
// - Limits are checked, and homing required, before anything is sent.
// - A stop is never lost: it ends the operation under way, or else the next one before it moves.
// - Whatever goes wrong costs the position, but for a stop that kept it; the controller is then
//   suspect, is told to halt, and is restored before homing.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/stage.h"
#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

class ControllerStage : public Stage {
 public:
  StageLimits limits() const final { return limits_; }
  void Home(double deadline_s) final;
  void MoveTo(Vec2 centre_m, double deadline_s) final;
  // Asks the controller, unless another thread drives: then what that one heard last. A lost
  // position is an answer that says why, silence an error (kTimeout within two
  // seconds, kDisconnected).
  StagePosition Where() final;
  void Stop() final;

 protected:
  struct Operation {
    const char* name;
    SteadyTime deadline;
  };

  ControllerStage(const StageLimits& limits, std::shared_ptr<core::Clock> clock);

  // The conversation. All end by the operation's deadline, in a HardwareError where they cannot do
  // what they say; all call ThrowIfStopped while they wait.

  // Brings the stage to rest and the controller to where it takes commands. True if it has kept its
  // position, given that it had one.
  virtual bool Halt(const Operation& operation) = 0;
  // Finds the reference marks; returns when the stage stands there, and has said so.
  virtual void DriveHome(const Operation& operation) = 0;
  // Within the limits. Returns when the stage stands still there, and has said so.
  virtual void DriveTo(const Operation& operation, Vec2 centre_m) = 0;
  // Asks where it is, and passes it to Heard; throws where the position is lost.
  virtual void AskPosition(const Operation& operation) = 0;
  // From any thread: hands over what stops the motion, and returns at once.
  virtual void SendStop(bool homing, SteadyTime deadline) = 0;

  // For drivers.
  // Halts and restores the controller within the time, then does the work within twice as much:
  // on a slow line it is several questions, a second each.
  void Connect(double within_s, const std::function<void(const Operation&)>& work);
  void SetResolution(double resolution_m) { limits_.resolution_m = resolution_m; }
  void Heard(Vec2 readback_m, bool moving);  // what the controller has said
  void ThrowIfStopped(const Operation& operation);
  bool stop_requested() const { return stop_requested_; }
  bool homing() const { return homing_; }
  bool homed() const { return Known().homed; }  // false while homing
  // `lost`: with position_lost set, which a stop needs to say; other faults lose it anyway.
  HardwareError Failure(const Operation& operation, Fault fault, const std::string& problem,
                        const std::string& remedy, bool lost = false) const;

 private:
  void Guarded(const Operation& operation, const std::function<void()>& work);
  void Restore(const Operation& operation);
  StagePosition Known() const;
  void SetHomed(bool homed);
  void LosePosition(const std::string& why);

  StageLimits limits_;
  std::shared_ptr<core::Clock> clock_;
  std::mutex turn_;  // of the thread that drives
  std::atomic<bool> stop_requested_ = false, homing_ = false;
  bool suspect_ = true;

  mutable std::mutex known_mutex_;
  StagePosition known_;
};

}  // namespace luxfield::hal
