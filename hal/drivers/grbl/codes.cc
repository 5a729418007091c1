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

Meaning AlarmMeaning(int code) {
  return Find(kAlarms, code, {Fault::kStopped, "an alarm of no known meaning", kHome});
}

Meaning ErrorMeaning(int code) {
  return Find(kErrors, code,
              {Fault::kRefused, "an error of no known meaning", "look it up in the firmware"});
}

}  // namespace luxfield::hal::grbl
