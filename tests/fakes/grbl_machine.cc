#include "tests/fakes/grbl_machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace luxfield::fakes {
namespace {

constexpr std::size_t kInputBytes = 128;
constexpr double kSlice_s = 5e-4;
constexpr char kReset = 0x18;

// The firmware's defaults, with homing and soft limits on.
std::map<int, double> Defaults() {
  return {{0, 10},   {1, 25},    {2, 0},      {3, 0},     {4, 0},     {5, 0},     {6, 0},
          {10, 1},   {11, 0.01}, {12, 0.002}, {13, 0},    {20, 1},    {21, 1},    {22, 1},
          {23, 0},   {24, 25},   {25, 500},   {26, 250},  {27, 1},    {30, 1000}, {31, 0},
          {32, 0},   {100, 250}, {101, 250},  {102, 250}, {110, 500}, {111, 500}, {112, 500},
          {120, 10}, {121, 10},  {122, 10},   {130, 200}, {131, 200}, {132, 200}};
}

}  // namespace

GrblMachine::GrblMachine(const std::map<int, double>& settings, GrblKind kind)
    : kind_(kind), settings_(Defaults()) {
  for (const auto& [number, value] : settings) settings_[number] = value;
  motion_.PutCarriage({-0.4 * Set(130), -0.3 * Set(131), 0});
  Suffer("power cycle");
}

bool GrblMachine::Suffer(std::string_view event) {
  if (event == "power cycle") {
    motion_.Kill();
    motion_.SetPosition({});
    state_ = Set(22) != 0 ? State::kAlarm : State::kIdle;
    task_ = Task::kReadLines;
    critical_ = false;
    alarm_ = 0;
    Start();
  } else if (event == "limit switch") {
    if (Set(21) == 0 || state_ == State::kAlarm || state_ == State::kHome) return true;
    RequestReset();
    alarm_ = 1;
  } else if (event == "cut switches") {
    switches_cut_ = true;
  } else {
    return false;
  }
  return true;
}

void GrblMachine::Receive(std::string_view bytes) {
  for (const char c : bytes) {
    switch (c) {
      case '?':
        report_ = true;
        break;
      case '!':
        hold_ = true;
        break;
      case '~':
        resume_ = true;
        break;
      case kReset:
        RequestReset();
        break;
      default:  // other real-time commands change nothing here; they never enter the buffer
        if (static_cast<unsigned char>(c) < 0x80 && input_.size() < kInputBytes) input_ += c;
    }
  }
}

std::string GrblMachine::Transmit() { return std::exchange(out_, {}); }

bool GrblMachine::active() const {
  return !motion_.empty() || task_ != Task::kReadLines || !input_.empty() || alarm_ != 0 || reset_;
}

void GrblMachine::Advance(double seconds) {
  do {
    const double slice = std::min(seconds, kSlice_s);
    Step(slice);
    seconds -= slice;
  } while (seconds > 0);
}

void GrblMachine::Step(double seconds) {
  ExecuteRealtime();
  if (critical_) return;
  if (state_ == State::kRun || state_ == State::kHold) {
    const bool moving = motion_.Step(seconds, std::min(Set(120), Set(121)), state_ == State::kHold);
    if (!moving && state_ == State::kRun) state_ = State::kIdle;
    for (int axis = 0; axis < 2; ++axis)
      if (moving && Set(21) != 0 && AtSwitch(axis)) Suffer("limit switch");
  }
  if (task_ == Task::kBrakeForSoftLimit && motion_.speed() == 0) {
    state_ = State::kIdle;
    RequestReset();
    alarm_ = 2;
    return;
  }
  if (state_ != State::kHold) Work(seconds);
  if (state_ == State::kIdle && !motion_.empty()) state_ = State::kRun;
}

// A reset request stops the steppers at once; the main loop notices it afterwards.
void GrblMachine::RequestReset() {
  if (reset_) return;
  reset_ = true;
  const bool braking = state_ == State::kHold && motion_.speed() > 0;
  if (state_ == State::kHome) {
    if (alarm_ == 0) alarm_ = 6;
  } else if (state_ == State::kRun || braking) {
    alarm_ = 3;
  }
  motion_.Kill();
}

void GrblMachine::ExecuteRealtime() {
  if (alarm_ != 0) {
    state_ = State::kAlarm;
    Say(fmt::format("ALARM:{}", alarm_));
    if (alarm_ == 1 || alarm_ == 2) {
      Say("[MSG:Reset to continue]");
      critical_ = true;
      reset_ = false;
    }
    alarm_ = 0;
  }
  if (critical_ && !reset_) return;
  critical_ = false;
  if (reset_) {
    if (task_ != Task::kReadLines) Finish(0);  // the line in work returns as if it were done
    Start();
    return;
  }
  if (report_ && state_ != State::kHome) Report();
  if (hold_ && (state_ == State::kIdle || state_ == State::kRun)) state_ = State::kHold;
  if (resume_ && state_ == State::kHold && motion_.speed() == 0)
    state_ = motion_.empty() ? State::kIdle : State::kRun;
  hold_ = resume_ = false;
}

void GrblMachine::Start() {
  reset_ = hold_ = resume_ = report_ = false;
  input_.clear();
  line_.clear();
  line_overflow_ = false;
  task_ = Task::kReadLines;
  waiting_move_.reset();
  inches_ = incremental_ = false;
  rapid_ = true;
  feed_ = 0;
  wco_countdown_ = override_countdown_ = 0;
  if (state_ != State::kAlarm) state_ = State::kIdle;
  const bool locked = state_ == State::kAlarm;
  Say("");
  switch (kind_) {
    case GrblKind::kGrbl:
      Say("Grbl 1.1h ['$' for help]");
      if (locked) Say("[MSG:'$H'|'$X' to unlock]");
      break;
    case GrblKind::kGrblHal:
      Say("GrblHAL 1.1f ['$' or '$HELP' for help]");
      if (locked) Say("ALARM:11");
      if (locked) Say("[MSG:Homing cycle required]");
      break;
    case GrblKind::kFluidNc:
      Say("Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]");
      if (locked) Say("[MSG:INFO: ALARM: Unhomed]");
      if (locked) Say("ALARM:14");
      break;
  }
}

void GrblMachine::SayIdentity() {
  switch (kind_) {
    case GrblKind::kGrbl:
      Say("[VER:1.1h.20190825:]");
      Say("[OPT:V,15,128]");
      break;
    case GrblKind::kGrblHal:
      for (const char* line :
           {"[VER:1.1f.20260817:]", "[OPT:VNM+,100,1024,3,0]", "[AXS:3:XYZ]",
            "[NEWOPT:ENUMS,RT+,HOME,TC,SED]", "[FIRMWARE:grblHAL]", "[SIGNALS:D]",
            "[NVS STORAGE:*EEPROM]", "[DRIVER:Simulator]", "[DRIVER VERSION:260324]"})
        Say(line);
      break;
    case GrblKind::kFluidNc:
      Say("[VER:3.9 FluidNC v3.9.1 (esp32-wifi) :]");
      Say("[OPT:PHSEW]");
      Say("[MSG:Machine: bench]");
      break;
  }
}

void GrblMachine::Report() {
  report_ = false;
  static constexpr std::array kNames = {"Idle", "Run", "Hold", "Alarm", "Home"};
  std::string text = kNames[static_cast<std::size_t>(state_)];
  if (state_ == State::kHold) text += motion_.speed() > 0 ? ":1" : ":0";
  const int mask = static_cast<int>(Set(10));
  const Axes& at = motion_.position();
  text += (mask & 1) != 0 ? "|MPos:" : "|WPos:";
  for (int k = 0; k < 3; ++k)
    text += fmt::format("{}{:.3f}", k == 0 ? "" : ",",
                        std::round(at[k] * Set(100 + k)) / Set(100 + k) + 0.0);
  if ((mask & 2) != 0)
    text += fmt::format("|Bf:{},{}", motion_.free_blocks(), kInputBytes - input_.size());
  text += fmt::format("|FS:{:.0f},0", motion_.speed() * 60);
  std::string pins;
  for (int axis = 0; axis < 2; ++axis)
    if (AtSwitch(axis)) pins += "XY"[axis];
  if (!pins.empty()) text += "|Pn:" + pins;
  const bool busy = state_ != State::kIdle && state_ != State::kAlarm;
  if (wco_countdown_ > 0) {
    --wco_countdown_;
  } else {
    wco_countdown_ = (busy ? 30 : 10) - 1;
    if (override_countdown_ == 0) override_countdown_ = 1;
    text += "|WCO:0.000,0.000,0.000";
  }
  if (override_countdown_ > 0) {
    --override_countdown_;
  } else {
    override_countdown_ = (busy ? 20 : 10) - 1;
    text += "|Ov:100,100,100";
  }
  Say("<" + text + ">");
}

void GrblMachine::Finish(int error) {
  Say(error == 0 ? "ok" : fmt::format("error:{}", error));
  task_ = Task::kReadLines;
}

void GrblMachine::Work(double seconds) {
  switch (task_) {
    case Task::kReadLines:
      ReadLines();
      break;
    case Task::kWaitForRoom:
      if (!motion_.full()) {
        motion_.Add(*std::exchange(waiting_move_, {}));
        Finish(0);
      }
      break;
    case Task::kWaitForMoves:
      if (motion_.empty()) task_ = Task::kDwell;
      break;
    case Task::kDwell:
      wait_s_ -= seconds;
      if (wait_s_ <= 0) Finish(0);
      break;
    case Task::kBrakeForSoftLimit:
      break;
    case Task::kHoming:
      Home(seconds);
      break;
  }
}

double GrblMachine::HomeMm(int axis) const {
  if (kind_ == GrblKind::kFluidNc) return kFluidNcHome_mm;
  return HomesLow(axis) ? Set(27) - Set(130 + axis) : -Set(27);
}

bool GrblMachine::HomesLow(int axis) const { return (static_cast<int>(Set(23)) >> axis & 1) != 0; }

// The way an axis still has before it presses its switch, mm.
double GrblMachine::ToSwitch(int axis) const {
  const double at = motion_.carriage()[axis];
  if (switches_cut_) return HUGE_VAL;
  return HomesLow(axis) ? at + Set(130 + axis) : -at;
}

bool GrblMachine::AtSwitch(int axis) const { return ToSwitch(axis) <= 0; }

// Seek, pull off, locate, pull off; each followed by the switches' debouncing. Constant speeds.
// Grbl looks at the switches with every step; here an axis stops where it presses one, so that
// the carriage is where the controller believes it is.
void GrblMachine::Home(double seconds) {
  if (wait_s_ > 0) {
    wait_s_ -= seconds;
    return;
  }
  const bool approach = homing_phase_ % 2 == 0;
  const double rate = (homing_phase_ == 2 ? Set(24) : Set(25)) / 60;
  for (int axis = 0; axis < 2; ++axis) {
    if (homing_done_[axis]) continue;
    const double reach =
        approach ? (homing_phase_ == 0 ? 1.5 * Set(130 + axis) : 5 * Set(27)) : Set(27);
    double step = std::min(rate * seconds, reach - homing_way_[axis]);
    if (approach && !AtSwitch(axis)) step = std::min(step, ToSwitch(axis));
    motion_.Shift(axis, (HomesLow(axis) == approach ? -1 : 1) * step);
    homing_way_[axis] += step;
    const bool end = homing_way_[axis] >= reach;
    if (approach && AtSwitch(axis)) {
      homing_done_[axis] = true;
    } else if (approach && end) {
      alarm_ = 9;
      RequestReset();
      return;
    } else if (end) {
      homing_done_[axis] = true;
      if (AtSwitch(axis)) {
        alarm_ = 8;
        RequestReset();
        return;
      }
    }
  }
  if (!homing_done_[0] || !homing_done_[1]) return;
  homing_done_ = {};
  homing_way_ = {};
  wait_s_ = Set(26) / 1000;
  if (++homing_phase_ < 4) return;
  motion_.SetPosition({HomeMm(0), HomeMm(1), 0});
  state_ = State::kIdle;
  Finish(0);
}

}  // namespace luxfield::fakes
