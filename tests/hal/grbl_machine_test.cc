// The fake Grbl controller against what real ones were recorded to say. Sources: issues of the
// firmware's repositories, by number; "interface.md" is the firmware's own document.
#include "tests/fakes/grbl_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace luxfield::fakes {
namespace {

using Lines = std::vector<std::string>;
using testing::ElementsAre;
using testing::HasSubstr;

// What the machine says within `seconds` after it has got `bytes`; empty lines left out.
Lines Say(GrblMachine& machine, const std::string& bytes, double seconds = 0.1) {
  machine.Receive(bytes);
  machine.Advance(seconds);
  Lines lines;
  std::string line;
  for (const char c : machine.Transmit())
    if (c != '\n' && c != '\r') {
      line += c;
    } else if (!line.empty()) {
      lines.push_back(std::exchange(line, {}));
    }
  return lines;
}

const std::string kWelcome = "Grbl 1.1h ['$' for help]", kUnlock = "[MSG:'$H'|'$X' to unlock]";
const std::string kReset = "\x18";

GrblMachine Homed(std::map<int, double> settings = {}) {
  settings.merge(std::map<int, double>{
      {24, 600}, {25, 6000}, {110, 6000}, {111, 6000}, {120, 200}, {121, 200}});
  GrblMachine machine(settings);
  Say(machine, "");
  EXPECT_THAT(Say(machine, "$H\n", 10), ElementsAre("ok"));
  return machine;
}

// gnea/grbl#757: power-up with homing on, a status query, $$, and a move while locked.
TEST(GrblMachine, StartsLockedAndListsItsSettings) {
  GrblMachine machine({{1, 25},
                       {10, 8},
                       {20, 0},
                       {21, 1},
                       {22, 1},
                       {32, 1},
                       {100, 800},
                       {101, 800},
                       {102, 800},
                       {110, 800},
                       {111, 800},
                       {112, 800},
                       {130, 320},
                       {131, 140},
                       {132, 34}});
  EXPECT_THAT(Say(machine, ""), ElementsAre(kWelcome, kUnlock));
  EXPECT_THAT(Say(machine, "?"),
              ElementsAre("<Alarm|WPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>"));
  EXPECT_THAT(Say(machine, "$$\n"),
              ElementsAre("$0=10", "$1=25", "$2=0", "$3=0", "$4=0", "$5=0", "$6=0", "$10=8",
                          "$11=0.010", "$12=0.002", "$13=0", "$20=0", "$21=1", "$22=1", "$23=0",
                          "$24=25.000", "$25=500.000", "$26=250", "$27=1.000", "$30=1000", "$31=0",
                          "$32=1", "$100=800.000", "$101=800.000", "$102=800.000", "$110=800.000",
                          "$111=800.000", "$112=800.000", "$120=10.000", "$121=10.000",
                          "$122=10.000", "$130=320.000", "$131=140.000", "$132=34.000", "ok"));
  EXPECT_THAT(Say(machine, "G28\n"), ElementsAre("error:9"));
}

// grblHAL's simulator (core of 2026-08): power-up with $22=5, a status query, $I.
TEST(GrblMachine, GreetsAsGrblHal) {
  GrblMachine machine({}, GrblKind::kGrblHal);
  EXPECT_THAT(Say(machine, ""), ElementsAre("GrblHAL 1.1f ['$' or '$HELP' for help]", "ALARM:11",
                                            "[MSG:Homing cycle required]"));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("<Alarm|MPos:0.000,0.000,0.000|")));
  EXPECT_THAT(
      Say(machine, "$I\n"),
      ElementsAre("[VER:1.1f.20260817:]", "[OPT:VNM+,100,1024,3,0]", "[AXS:3:XYZ]",
                  "[NEWOPT:ENUMS,RT+,HOME,TC,SED]", "[FIRMWARE:grblHAL]", "[SIGNALS:D]",
                  "[NVS STORAGE:*EEPROM]", "[DRIVER:Simulator]", "[DRIVER VERSION:260324]", "ok"));
}

// Report.cpp, Protocol.cpp, ProcessSettings.cpp and RuntimeSetting.cpp of FluidNC.
TEST(GrblMachine, GreetsAsFluidNc) {
  GrblMachine machine({{20, 1}}, GrblKind::kFluidNc);
  EXPECT_THAT(Say(machine, ""), ElementsAre("Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]",
                                            "[MSG:INFO: ALARM: Unhomed]", "ALARM:14"));
  EXPECT_THAT(Say(machine, "$I\n"), ElementsAre("[VER:3.9 FluidNC v3.9.1 (esp32-wifi) :]",
                                                "[OPT:PHSEW]", "[MSG:Machine: bench]", "ok"));
  EXPECT_THAT(Say(machine, "$/axes/y/homing/mpos_mm\n"),
              ElementsAre("$/axes/y/homing/mpos_mm=12.000", "ok"));
  EXPECT_THAT(Say(machine, "$/axes/x/soft_limits\n"),
              ElementsAre("$/axes/x/soft_limits=true", "ok"));
  EXPECT_THAT(Say(machine, "$$\n"), testing::Not(testing::Contains(HasSubstr("$27="))));
}

// usbcnc/grbl#22 (1.1f): the offset comes in the first report, overrides in the second, then
// neither. (The probe pin and the accessories of that machine are not modelled.)
TEST(GrblMachine, ReportsOffsetAndOverridesInTurns) {
  GrblMachine machine;
  Say(machine, "");
  const std::string plain = "<Alarm|MPos:0.000,0.000,0.000|FS:0,0>";
  EXPECT_THAT(Say(machine, "?"),
              ElementsAre("<Alarm|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>"));
  EXPECT_THAT(Say(machine, "?"),
              ElementsAre("<Alarm|MPos:0.000,0.000,0.000|FS:0,0|Ov:100,100,100>"));
  for (int k = 0; k < 8; ++k) EXPECT_THAT(Say(machine, "?"), ElementsAre(plain));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("|WCO:")));
  EXPECT_THAT(Say(machine, "??"), testing::SizeIs(1)) << "interface.md: the second is ignored";
}

// gnea/grbl#773 (1.1g): homing that finds no switch ends in ALARM:9, an `ok`, and a restart.
TEST(GrblMachine, AFailedHomingSaysOkBehindItsAlarm) {
  GrblMachine machine(std::map<int, double>{{25, 60000}});
  Say(machine, "");
  machine.Suffer("cut switches");
  EXPECT_THAT(Say(machine, "$H\n", 10), ElementsAre("ALARM:9", "ok", kWelcome, kUnlock));
}

// gnea/grbl#757 and #958: a limit switch ends in a state that nothing but a reset leaves; only then
// $X unlocks.
TEST(GrblMachine, ALimitSwitchLocksUntilReset) {
  GrblMachine machine = Homed();
  Say(machine, "G1 X-100 F6000\n", 0.3);
  machine.Suffer("limit switch");
  EXPECT_THAT(Say(machine, ""), ElementsAre("ALARM:1", "[MSG:Reset to continue]"));
  EXPECT_THAT(Say(machine, "$X\n?", 1), ElementsAre());
  EXPECT_THAT(Say(machine, kReset), ElementsAre(kWelcome, kUnlock));
  EXPECT_THAT(Say(machine, "$X\n"), ElementsAre("[MSG:Caution: Unlocked]", "ok"));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("<Idle|")));
}

// grbl/grbl#226: a move beyond the travel raises the alarm without moving; the reset is answered by
// `ok`, and the alarm stays. interface.md: the position is kept.
TEST(GrblMachine, ASoftLimitKeepsThePosition) {
  GrblMachine machine = Homed();
  EXPECT_THAT(Say(machine, "G0 X260\n"), ElementsAre("ALARM:2", "[MSG:Reset to continue]"));
  EXPECT_THAT(Say(machine, kReset), ElementsAre("ok", kWelcome, kUnlock));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("<Alarm|MPos:-1.000,-1.000,0.000|")));
}

// Recorded from the firmware run on a PC: a reset while moving is ALARM:3 and locks.
TEST(GrblMachine, AResetInMotionIsAnAlarm) {
  GrblMachine machine = Homed();
  EXPECT_THAT(Say(machine, "G1 X-100 F6000\n", 0.3), ElementsAre("ok"));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("<Run|")));
  EXPECT_THAT(Say(machine, kReset), ElementsAre("ALARM:3", kWelcome, kUnlock));
  EXPECT_THAT(Say(machine, "G0 X0\n"), ElementsAre("error:9"));
}

// interface.md: Hold:1 while braking, where a reset throws an alarm; Hold:0 after it, where it does
// not, and the position stays.
TEST(GrblMachine, AHoldIsCompleteBeforeAResetIsSafe) {
  GrblMachine machine = Homed();
  Say(machine, "G1 X-100 F6000\n", 0.9);
  EXPECT_THAT(Say(machine, "!", 0.001), ElementsAre());
  EXPECT_THAT(Say(machine, "?", 0.001), ElementsAre(HasSubstr("<Hold:1|")));
  const Lines held = Say(machine, "?", 2);
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("<Hold:0|")));
  const double x = machine.motion().position()[0];
  EXPECT_THAT(Say(machine, kReset, 1), ElementsAre(kWelcome));
  EXPECT_EQ(machine.motion().position()[0], x);
  EXPECT_LT(x, -20);
  EXPECT_GT(x, -99);

  Say(machine, "G1 X-2 F6000\n", 0.3);
  Say(machine, "!", 0.001);
  EXPECT_THAT(Say(machine, kReset), ElementsAre("ALARM:3", kWelcome, kUnlock));
}

// grbl/grbl#1296: the dwell's response waits for all moves before it.
TEST(GrblMachine, ADwellAnswersWhenTheMovesAreDone) {
  GrblMachine machine = Homed();
  EXPECT_THAT(Say(machine, "G1X-50F6000\nG4P0.01\n", 0.3), ElementsAre("ok"));
  EXPECT_THAT(Say(machine, "", 2), ElementsAre("ok"));
  EXPECT_NEAR(machine.motion().position()[0], -50, 1e-6);
}

// commands.md, error_codes_en_US.csv.
TEST(GrblMachine, AnswersEveryLineOnce) {
  GrblMachine machine = Homed({{22, 1}});
  EXPECT_THAT(Say(machine, "\n"), ElementsAre("ok"));
  EXPECT_THAT(Say(machine, "$foo\n"), ElementsAre("error:2"));
  EXPECT_THAT(Say(machine, "G1 X-5\n"), ElementsAre("error:22"));
  EXPECT_THAT(Say(machine, "G5\n"), ElementsAre("error:20"));
  EXPECT_THAT(Say(machine, "12\n"), ElementsAre("error:1"));
  EXPECT_THAT(Say(machine, "G1 G0 X1\n"), ElementsAre("error:21"));
  EXPECT_THAT(Say(machine, "G1 X1 X2 F5\n"), ElementsAre("error:25"));
  EXPECT_THAT(Say(machine, std::string(90, 'G') + "\n"), ElementsAre("error:11"));
  EXPECT_THAT(Say(machine, "$22=0\n$20=1\n"), ElementsAre("ok", "error:10"));
  EXPECT_THAT(Say(machine, "$H\n"), ElementsAre("error:5"));
  EXPECT_THAT(Say(machine, "g1 x-5 f6000 (comment-free)\n"), ElementsAre("error:1"));
  Say(machine, "G1 X-5 F600\n", 0.05);
  EXPECT_THAT(Say(machine, "$H\n", 0.01), ElementsAre("error:8"));
}

// interface.md: 15 blocks and 128 bytes; the 16th move is answered when there is room.
TEST(GrblMachine, BuffersFillAndOverflow) {
  GrblMachine machine = Homed({{10, 3}});
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("|Bf:15,128|")));
  std::string moves;
  for (int k = 0; k < 16; ++k) moves += "G1X" + std::to_string(-10 - 100 * (k % 2)) + "F6000\n";
  machine.Receive(moves.substr(0, 100));
  machine.Advance(0.02);
  EXPECT_THAT(Say(machine, moves.substr(100), 0.1), testing::SizeIs(15));
  EXPECT_THAT(Say(machine, "?"), ElementsAre(HasSubstr("|Bf:0,128|")));
  machine.Receive(std::string(500, ' '));
  EXPECT_THAT(Say(machine, "?", 0.001), ElementsAre(HasSubstr("|Bf:0,0|")));
  EXPECT_THAT(Say(machine, "", 3), ElementsAre("ok"));
}

}  // namespace
}  // namespace luxfield::fakes
