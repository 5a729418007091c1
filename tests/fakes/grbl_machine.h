// A Grbl 1.1h controller with an XY carriage and home switches: a test tool, written after the
// firmware's documents (doc/markdown/interface.md, commands.md, doc/csv) and checked against
// recorded conversations of real controllers (tests/hal/grbl_machine_test.cc). It can greet, number
// its alarms and describe itself as grblHAL and FluidNC do.
//
// Modelled: 128 bytes of input, lines of 80, 15 waiting moves; `?` `!` `~` and reset picked out of
// the stream; $$ $n= $I $G $X $H; G0 G1 G4 G20 G21 G53 G54 G90 G91 G94; soft limits, limit
// switches, homing in four phases, all states but Door, Jog, Check and Sleep. Where a reset breaks
// off a line, its `ok` comes before the welcome, as it does from the firmware.
#pragma once

#include <map>
#include <optional>

#include "tests/fakes/fake_device.h"
#include "tests/fakes/grbl_motion.h"

namespace luxfield::fakes {

enum class GrblKind { kGrbl, kGrblHal, kFluidNc };

class GrblMachine : public FakeDevice {
 public:
  // Where homing leaves the axes of FluidNC, mm.
  static constexpr double kFluidNcHome_mm = 12;

  // `settings` replace the defaults ($n = value). Starts switched on, its welcome said.
  explicit GrblMachine(const std::map<int, double>& settings = {}, GrblKind kind = GrblKind::kGrbl);

  void Receive(std::string_view bytes) override;
  void Advance(double seconds) override;
  std::string Transmit() override;
  bool active() const override;
  // "power cycle"; "limit switch": one is touched; "cut switches": they never trigger again.
  bool Suffer(std::string_view event) override;

  const GrblMotion& motion() const { return motion_; }

 private:
  enum class State { kIdle, kRun, kHold, kAlarm, kHome };
  // What the firmware's main loop is busy with.
  enum class Task { kReadLines, kWaitForRoom, kWaitForMoves, kDwell, kBrakeForSoftLimit, kHoming };

  void Say(const std::string& line) { out_ += line + "\r\n"; }
  double Set(int number) const { return settings_.at(number); }

  void Step(double seconds);
  void ExecuteRealtime();
  void Work(double seconds);
  void Home(double seconds);
  void RequestReset();
  void Start();
  void Report();
  void ReadLines();
  void Finish(int error);

  // The response's number: 0 ok, -1 not finished yet.
  int Execute(const std::string& line);
  int ExecuteSystem(const std::string& line);
  int ReportItem(const std::string& name);
  int ExecuteBlock(const std::string& line);
  int PlanMove(const GrblMotion::Block& block);

  void SayIdentity();
  double HomeMm(int axis) const;
  double ToSwitch(int axis) const;
  bool AtSwitch(int axis) const;
  bool HomesLow(int axis) const;

  GrblKind kind_;
  std::map<int, double> settings_;
  GrblMotion motion_;
  State state_ = State::kIdle;
  Task task_ = Task::kReadLines;
  std::string out_, input_, line_;
  bool line_overflow_ = false;

  int alarm_ = 0;  // raised, not yet said
  bool critical_ = false, reset_ = false, hold_ = false, resume_ = false, report_ = false;
  int wco_countdown_ = 0, override_countdown_ = 0;

  double wait_s_ = 0;  // rest of a dwell or of the switches' debouncing
  std::optional<GrblMotion::Block> waiting_move_;
  int homing_phase_ = 0;
  std::array<double, 2> homing_way_{};
  std::array<bool, 2> homing_done_{};
  bool switches_cut_ = false;

  // Modal state.
  bool inches_ = false, incremental_ = false, rapid_ = true;
  double feed_ = 0;  // mm/min
};

}  // namespace luxfield::fakes
