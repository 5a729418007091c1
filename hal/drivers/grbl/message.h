// What Grbl 1.1 says, a line at a time. Source: "Grbl v1.1 Interface" (doc/markdown/interface.md of
// the firmware's repository). grblHAL (report.c) and FluidNC (Report.cpp) say the same with another
// welcome and further lines.
//
// Every line sent is answered by exactly one response, `ok` or `error:N`. Everything else is pushed
// at any time and answers nothing.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace luxfield::hal::grbl {

enum class State { kIdle, kRun, kHold, kJog, kAlarm, kDoor, kCheck, kHome, kSleep };
std::string StateName(State state);

using Position = std::array<double, 3>;  // X, Y, Z as reported: mm, or inches with $13=1

// <State:substate|MPos:x,y,z|...>; fields after the position come in any order, or not at all.
struct Status {
  State state = State::kIdle;
  int substate = 0;  // Hold 0: complete, 1: still slowing down
  Position position{};
  bool work_position = false;           // WPos; the machine position is WPos + WCO
  std::optional<Position> work_offset;  // WCO
  std::string pins;                     // triggered inputs, Pn
};

struct Ok {};
struct ErrorReply {
  int code = 0;
};
struct Alarm {
  int code = 0;
};
struct Firmware {
  std::string name = "Grbl";  // or "grblHAL", "FluidNC"
  std::string version;        // "1.1h"; FluidNC's own, "v3.9.1"
};
// The controller has just started, everything pending is gone.
struct Welcome {
  Firmware firmware;
};
struct Setting {
  int number = 0;
  double value = 0;
};
struct Feedback {
  std::string text;  // inside the brackets: "MSG:Reset to continue"
};
// A startup line ("> G54:ok"), an empty line, or something damaged.
struct Other {
  std::string text;
};

using Message = std::variant<Ok, ErrorReply, Alarm, Welcome, Setting, Feedback, Status, Other>;

// What a `[VER:...]` line names, without its bracket.
Firmware ParseVersion(std::string_view line);

// Never throws; what makes no sense as a whole is Other. All numbers are finite.
Message ParseMessage(std::string_view line);

}  // namespace luxfield::hal::grbl
