#include "luxfield/hal/drivers/grbl/codes.h"

#include <algorithm>
#include <array>

namespace luxfield::hal::grbl {
namespace {

struct Row {
  int code;
  Meaning meaning;
};

constexpr std::string_view kHome = "home the stage", kReport = "report this as a bug of the driver",
                           kSwitches = "check limit switches, wiring, $27 and $130, then home";

constexpr std::array kAlarms = {
    Row{1, {Fault::kStopped, "a limit switch was hit", "free the carriage by hand, then home"}},
    Row{2, {Fault::kOutOfRange, "the target lies outside the travel", "correct origin_m"}},
    Row{3, {Fault::kStopped, "reset while moving", kHome}},
    Row{4, {Fault::kStopped, "the probe was touching before probing", kHome}},
    Row{5, {Fault::kStopped, "the probe touched nothing", kHome}},
    Row{6, {Fault::kStopped, "homing was interrupted by a reset", "home again"}},
    Row{7, {Fault::kStopped, "the door opened during homing", "close it, then home"}},
    Row{8, {Fault::kNotHomed, "homing failed: a switch stayed on after pulling off", kSwitches}},
    Row{9, {Fault::kNotHomed, "homing failed: no switch within the search distance", kSwitches}},
};

constexpr std::array kGrblHalAlarms = {
    Row{10, {Fault::kStopped, "the emergency stop is pressed", "release it, then home"}},
    Row{11, {Fault::kNotHomed, "it has to be homed", kHome}},
    Row{12, {Fault::kStopped, "a limit switch is pressed", "free the carriage, then home"}},
    Row{13, {Fault::kStopped, "the probe is touching", "free it, then home"}},
    Row{14, {Fault::kStopped, "the spindle did not reach its speed", "switch it off, then home"}},
    Row{15, {Fault::kNotHomed, "homing failed: a second switch was not found", kSwitches}},
    Row{16, {Fault::kRefused, "its self-test failed", "switch it off and on"}},
    Row{17, {Fault::kStopped, "a motor reports a fault", "check motors and drivers, then home"}},
    Row{18, {Fault::kNotHomed, "homing is set up wrongly", "correct $22, $44 and $45"}},
    Row{20, {Fault::kRefused, "its board of inputs does not answer", "switch it off and on"}},
    Row{21, {Fault::kRefused, "its stored settings are unreadable", "restore its settings"}},
};

constexpr std::array kFluidNcAlarms = {
    Row{11, {Fault::kStopped, "an input was active at its start", "clear it, then home"}},
    Row{12,
        {Fault::kNotHomed, "homing failed: a switch serves both ends", "move it off, then home"}},
    Row{13, {Fault::kStopped, "its emergency stop was pressed", "release it, then home"}},
    Row{14, {Fault::kNotHomed, "it has to be homed", kHome}},
    Row{15, {Fault::kNotHomed, "it has just started", kHome}},
    Row{16, {Fault::kRefused, "its board of inputs has restarted", "switch it off and on"}},
};

constexpr std::array kErrors = {
    Row{1, {Fault::kProtocol, "a command letter was missing", "check the cable"}},
    Row{2, {Fault::kProtocol, "a number was damaged", "check the cable"}},
    Row{3,
        {Fault::kProtocol, "a $ command was not recognised", "check the cable and the firmware"}},
    Row{4, {Fault::kRefused, "a value was negative", kReport}},
    Row{5, {Fault::kRefused, "homing is switched off", "send $22=1 and connect home switches"}},
    Row{6, {Fault::kRefused, "the step pulse is below 3 us", "correct $0"}},
    Row{7,
        {Fault::kRefused, "the stored settings were unreadable and have been replaced",
         "restore the machine's settings"}},
    Row{8, {Fault::kRefused, "a $ command came while the machine was not idle", "wait or stop it"}},
    Row{9, {Fault::kNotHomed, "motion is locked by an alarm", kHome}},
    Row{10, {Fault::kRefused, "soft limits need homing", "send $22=1"}},
    Row{11, {Fault::kProtocol, "the line was too long", "check the cable"}},
    Row{12, {Fault::kRefused, "the step rate is beyond the controller", "lower $100 or $110"}},
    Row{13, {Fault::kStopped, "the safety door is open", "close it"}},
    Row{14, {Fault::kRefused, "the stored line is too long", kReport}},
    Row{15, {Fault::kOutOfRange, "the jog target lies outside the travel", "correct origin_m"}},
    Row{16, {Fault::kProtocol, "the jog command was damaged", "check the cable"}},
    Row{17, {Fault::kRefused, "laser mode needs PWM", "send $32=0"}},
    Row{20, {Fault::kProtocol, "a command is not supported", "check the cable and the firmware"}},
    Row{21, {Fault::kProtocol, "commands exclude each other", "check the cable"}},
    Row{22, {Fault::kProtocol, "the feed rate was missing", "check the cable"}},
    Row{23, {Fault::kProtocol, "a number should be whole", "check the cable"}},
    Row{24, {Fault::kProtocol, "two commands want the axes", "check the cable"}},
    Row{25, {Fault::kProtocol, "a word came twice", "check the cable"}},
    Row{26, {Fault::kProtocol, "the axes were missing", "check the cable"}},
    Row{27, {Fault::kProtocol, "the line number is invalid", "check the cable"}},
    Row{28, {Fault::kProtocol, "a value was missing", "check the cable"}},
    Row{33, {Fault::kProtocol, "the target is invalid", "check the cable"}},
};

template <typename Table>
Meaning Find(const Table& table, int code, Meaning otherwise) {
  const auto row =
      std::find_if(table.begin(), table.end(), [&](const Row& r) { return r.code == code; });
  return row == table.end() ? otherwise : row->meaning;
}

}  // namespace

Meaning AlarmMeaning(int code, std::string_view firmware) {
  const Meaning otherwise = {Fault::kStopped, "an alarm of no known meaning", kHome};
  if (code < 10) return Find(kAlarms, code, otherwise);
  if (firmware == "FluidNC") return Find(kFluidNcAlarms, code, otherwise);
  return Find(kGrblHalAlarms, code, otherwise);
}

Meaning ErrorMeaning(int code) {
  return Find(kErrors, code,
              {Fault::kRefused, "an error of no known meaning", "look it up in the firmware"});
}

}  // namespace luxfield::hal::grbl
