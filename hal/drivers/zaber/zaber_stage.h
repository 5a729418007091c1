// A stage of two Zaber axes on one serial line, in the ASCII protocol.
//
// Commands carry a message id and a checksum; what answers another id is ignored. A move is done
// when both axes say IDLE without a warning and read back the microsteps they were sent to.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "luxfield/hal/drivers/zaber/message.h"
#include "luxfield/hal/transport/controller_stage.h"
#include "luxfield/hal/transport/line_reader.h"

namespace luxfield::hal::zaber {

// A filter coordinate c and the axis' position in microsteps:
//   microsteps = round((origin_m + sign c) / microstep_m)
struct Axis {
  int device = 1, number = 1;
  int sign = 1;
  double origin_m = 0;
  double microstep_m = 0;  // of the stage's data sheet

  long Microsteps(double metres) const;
  double Metres(double microsteps) const;
};

struct StageSetup {
  StageLimits limits;
  std::array<Axis, 2> axes;
};

class ZaberStage final : public ControllerStage {
 public:
  // Stops both axes, sets their maxspeed to the lab's and reads it back. HardwareError(kRefused) if
  // the lab's limits or speed are beyond theirs, kTimeout if nobody answers within 5 s.
  ZaberStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
             std::shared_ptr<core::Clock> clock);

  std::string identity() const override { return identity_; }

 private:
  bool Halt(const Operation& operation) override;
  void DriveHome(const Operation& operation) override;
  void DriveTo(const Operation& operation, Vec2 centre_m) override;
  void AskPosition(const Operation& operation) override;
  void SendStop(bool homing, SteadyTime deadline) override;

  Reply Ask(const Operation& operation, const Axis& axis, std::string_view text);
  double AskNumber(const Operation& operation, const Axis& axis, std::string_view setting);
  void CheckAxis(const Operation& operation, const Axis& axis, const StageSetup& setup, int k);
  bool Look(const Operation& operation, bool forgiving);
  void Pause(const Operation& operation);
  void CheckWarning(const Operation& operation, const Reply& reply) const;

  std::unique_ptr<ByteStream> stream_;
  LineReader reader_;
  std::array<Axis, 2> axes_;
  std::string identity_;
  int id_ = 0;
};

}  // namespace luxfield::hal::zaber
