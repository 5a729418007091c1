// A stage moved by a Grbl 1.1, grblHAL or FluidNC controller, over any byte stream.
//
// A move is done when the controller has drained its planner (the `ok` of a dwell sent behind it)
// and two status reports in a row say Idle at the target, within a step. A stop is a feed hold, the
// wait for its end, and a reset: the position survives it. Alarms and restarts lose it, and only
// homing brings it back: the driver never unlocks ($X).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/hal/drivers/grbl/machine.h"
#include "luxfield/hal/transport/controller_stage.h"
#include "luxfield/hal/transport/line_reader.h"

namespace luxfield::hal::grbl {

class GrblStage final : public ControllerStage {
 public:
  // Halts what may still be moving, restarts the controller, reads its settings and checks them
  // (CheckController). HardwareError(kTimeout) if nothing answers like Grbl within 5 s.
  GrblStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
            std::shared_ptr<core::Clock> clock);

  std::string identity() const override { return identity_; }

 private:
  bool Halt(const Operation& operation) override;
  void DriveHome(const Operation& operation) override;
  void DriveTo(const Operation& operation, Vec2 centre_m) override;
  void AskPosition(const Operation& operation) override;
  void SendStop(bool homing, SteadyTime deadline) override;

  void SendRealtime(char command, SteadyTime deadline);
  std::optional<Message> Listen(const Operation& operation, SteadyTime until);
  std::vector<Message> Command(const Operation& operation, const std::string& line);
  Status AskStatus(const Operation& operation);
  void LearnFluidNc(const Operation& operation);
  std::string AskItem(const Operation& operation, const std::string& name);
  void CheckUndisturbed(const Operation& operation, const Status& status) const;
  void WaitUntilStandingAt(const Operation& operation, const std::array<double, 2>& target_mm);

  void Remember(const Status& status);
  std::optional<std::array<double, 2>> MachineMm(const Status& status) const;

  std::unique_ptr<ByteStream> stream_;
  LineReader reader_;
  std::array<Axis, 2> axes_;
  double feed_mm_per_min_;
  Controller controller_;
  std::string identity_;
  std::optional<Position> work_offset_;  // the last one reported
};

}  // namespace luxfield::hal::grbl
