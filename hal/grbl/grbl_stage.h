// A stage moved by a Grbl 1.1 controller, over any byte stream.
//
// A move is done when the controller has drained its planner (the `ok` of a dwell sent behind it)
// and two status reports in a row say Idle at the target, within a step. A stop is a feed hold, the
// wait for its end, and a reset: the position survives it. Position is lost with any alarm,
// restart, missed deadline or broken connection; only homing brings it back: the driver never
// unlocks ($X).
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "hal/error.h"
#include "hal/grbl/machine.h"
#include "hal/transport/line_reader.h"

namespace luxfield::hal::grbl {

class GrblStage : public Stage {
 public:
  // Halts what may still be moving, restarts the controller, reads its settings and checks them
  // (CheckController). HardwareError(kTimeout) if nothing answers like Grbl within 5 s.
  GrblStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
            std::shared_ptr<core::Clock> clock);

  std::string identity() const override { return identity_; }
  StageLimits limits() const override { return setup_.limits; }
  void Home(double deadline_s) override;
  void MoveTo(Vec2 centre_m, double deadline_s) override;
  // Asks the controller, unless another thread moves it: then the last report of that.
  StagePosition Where() override;
  // From any thread. The hold is sent at once; a move under way then ends with Fault::kStopped, its
  // position kept; homing is broken off, its position lost.
  void Stop() override;

 private:
  struct Operation {
    const char* name;
    SteadyTime deadline;
  };
  // The stage is one thread's at a time; a stop that came meanwhile is seen to at the end.
  class Turn;

  template <typename Work>
  void Guarded(const Operation& operation, Work&& work);
  HardwareError Failure(const Operation& operation, Fault fault, const std::string& problem,
                        const std::string& remedy) const;

  void SendRealtime(char command, SteadyTime deadline);
  std::optional<Message> Listen(const Operation& operation, SteadyTime until);
  std::vector<Message> Command(const Operation& operation, const std::string& line);
  Status AskStatus(const Operation& operation);
  bool Halt(const Operation& operation);
  void ThrowIfStopped(const Operation& operation);
  void CheckUndisturbed(const Operation& operation, const Status& status) const;
  void WaitUntilStandingAt(const Operation& operation, const std::array<double, 2>& target_mm);
  void FinishStop();

  void Remember(const Status& status);
  std::optional<std::array<double, 2>> MachineMm(const Status& status) const;
  bool homed() const;
  void SetHomed(bool homed);

  std::unique_ptr<ByteStream> stream_;
  LineReader reader_;
  StageSetup setup_;
  std::shared_ptr<core::Clock> clock_;
  Controller controller_;
  std::string identity_;

  std::mutex turn_;
  std::atomic<bool> stop_requested_ = false, homing_ = false;
  bool suspect_ = true;  // to be halted and restarted before it is used again
  std::optional<Position> work_offset_;

  mutable std::mutex known_mutex_;
  StagePosition known_;
};

}  // namespace luxfield::hal::grbl
