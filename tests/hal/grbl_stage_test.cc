// What is particular to the Grbl driver; what every stage has to do is in stage_conformance.cc.
#include "luxfield/hal/drivers/grbl/grbl_stage.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <utility>

#include "luxfield/hal/lab/identify_port.h"
#include "luxfield/hal/transport/faulty_stream.h"
#include "luxfield/hal/transport/open_port.h"
#include "luxfield/hal/transport/scripted_stream.h"
#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"

namespace luxfield::hal::grbl {
namespace {

using testing::HasSubstr;

const std::shared_ptr<core::Clock> kClock = std::make_shared<core::SystemClock>();
double In(double seconds) { return kClock->MonotonicSeconds() + seconds; }

StageSetup TestSetup() {
  StageSetup setup;
  setup.limits = {{-0.08, -0.06}, {0.08, 0.06}, 0.1, 0, 0};
  setup.axes = {Axis{0, 1, -100}, Axis{1, -1, -100}};
  return setup;
}

// With the same way above and below the middle of its travel.
StageSetup SetupOf(fakes::GrblKind kind) {
  StageSetup setup = TestSetup();
  if (kind == fakes::GrblKind::kFluidNc)
    for (Axis& axis : setup.axes) axis.origin_mm += fakes::GrblMachine::kFluidNcHome_mm;
  return setup;
}

const std::map<int, double> kQuick = {{110, 12000}, {111, 12000}, {120, 4000}, {121, 4000},
                                      {24, 3000},   {25, 60000},  {26, 5}};

std::map<int, double> Quick(std::map<int, double> more) {
  more.insert(kQuick.begin(), kQuick.end());
  return more;
}

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const HardwareError& error) {
    return error.what();
  }
  return "no error";
}

std::string ErrorOfConnecting(const std::map<int, double>& settings, const StageSetup& setup) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(Quick(settings)));
  return ErrorOf([&] { GrblStage stage(OpenSerialPort(host.port(), 115200), setup, kClock); });
}

Exchange Report(const std::string& state, const std::string& position) {
  return {"?", "<" + state + "|MPos:" + position + ",0.000|FS:0,0>\r\n"};
}

// A connection and a homing, to the byte, then `what_follows`. Reports follow interface.md.
std::deque<Exchange> Conversation(const std::vector<Exchange>& what_follows) {
  const std::string welcome = "\r\nGrbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n";
  std::string settings;
  for (const auto& [number, value] : std::map<int, double>{{13, 0}, {20, 1}, {22, 1}, {23, 0}})
    settings += fmt::format("${}={:.0f}\r\n", number, value);
  for (const int axis : {0, 1, 2})
    settings += fmt::format("${}=250.000\r\n${}=6000.000\r\n${}=200.000\r\n", 100 + axis,
                            110 + axis, 130 + axis);
  settings += "$27=1.000\r\nok\r\n";
  std::deque<Exchange> conversation = {
      {"", welcome},
      {"!", ""},
      Report("Alarm", "0.000,0.000"),
      {"\x18", welcome},
      {"?", "<Alarm|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n"},
      {"$I\n", "[VER:1.1h.20190825:]\r\n[OPT:V,15,128]\r\nok\r\n"},
      {"$$\n", settings},
      {"$H\n", "ok\r\n"},
      Report("Idle", "-1.000,-1.000"),
      Report("Idle", "-1.000,-1.000"),
  };
  conversation.insert(conversation.end(), what_follows.begin(), what_follows.end());
  return conversation;
}

TEST(GrblStage, RefusesAMachineThatIsNotTheLabs) {
  EXPECT_EQ(ErrorOfConnecting({}, TestSetup()), "no error");
  EXPECT_THAT(ErrorOfConnecting({{13, 1}}, TestSetup()), HasSubstr("$13=0"));
  EXPECT_THAT(ErrorOfConnecting({{22, 0}}, TestSetup()), HasSubstr("$22=1"));
  EXPECT_THAT(ErrorOfConnecting({{20, 0}}, TestSetup()), HasSubstr("$20=1"));
  EXPECT_THAT(ErrorOfConnecting({{130, 150}}, TestSetup()), HasSubstr("$130"));
  EXPECT_THAT(ErrorOfConnecting({{111, 600}}, TestSetup()), HasSubstr("$111"));
  StageSetup setup = TestSetup();
  setup.axes[1].origin_mm = -50;  // v up to 0.06 m would end at +10 mm
  EXPECT_THAT(ErrorOfConnecting({}, setup), HasSubstr("origin_m"));
}

TEST(GrblStage, SilenceIsNotGrbl) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>());
  host.Freeze(true);
  EXPECT_THAT(
      ErrorOf([&] { GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock); }),
      HasSubstr("timeout"));
}

// After power-up a controller that homes is locked, and says so to whoever asks. Wi-Fi, Bluetooth
// and busy hosts answer late, and the driver asks before the answer to a command has come.
TEST(GrblStage, OpensHomesAndMovesALockedControllerBehindASlowLine) {
  for (const auto& [each_way_s, kind] :
       {std::pair{0.15, fakes::GrblKind::kGrbl}, std::pair{0.5, fakes::GrblKind::kGrbl},
        std::pair{0.5, fakes::GrblKind::kFluidNc}}) {
    SCOPED_TRACE(fmt::format("{} s, kind {}", each_way_s, static_cast<int>(kind)));
    fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick, kind));
    host.Delay(each_way_s);
    GrblStage stage(OpenSerialPort(host.port(), 115200), SetupOf(kind), kClock);
    StagePosition where = stage.Where();
    EXPECT_FALSE(where.homed);
    EXPECT_EQ(where.lost, "") << "nothing was known that could be lost";
    EXPECT_THAT(ErrorOf([&] { stage.MoveTo({0, 0}, In(20)); }), HasSubstr("home it first"));
    stage.Home(In(20));
    stage.MoveTo({0.025, 0.012}, In(20));
    where = stage.Where();
    EXPECT_TRUE(where.homed);
    EXPECT_NEAR(where.readback.x, 0.025, 1e-5);
    EXPECT_NEAR(where.readback.y, 0.012, 1e-5);
  }
}

// An alarm whose line got lost shows in the next report only.
TEST(GrblStage, AMoveRefusesAControllerThatIsLocked) {
  auto script = std::make_unique<ScriptedStream>(Conversation({
      {"G21G90G94G53G1X-75.0000Y-112.0000F6000.000\n", "ok\r\n"},
      {"G4P0.01\n", "ok\r\n"},
      Report("Alarm", "-80.000,-100.000"),
      {"!", ""},
  }));
  const ScriptedStream& peer = *script;
  GrblStage stage(std::move(script), TestSetup(), kClock);
  stage.Home(In(5));
  EXPECT_THAT(ErrorOf([&] { stage.MoveTo({0.025, 0.012}, In(5)); }), HasSubstr("Alarm"));
  EXPECT_THAT(stage.Where().lost, HasSubstr("Alarm"));
  EXPECT_TRUE(peer.finished());
}

// They greet, number their alarms and place their home differently, and are asked by other names.
TEST(GrblStage, DrivesGrblHalAndFluidNc) {
  for (const auto& [kind, name] :
       {std::pair{fakes::GrblKind::kGrblHal, "grblHAL 1.1f.20260817 stage"},
        std::pair{fakes::GrblKind::kFluidNc, "FluidNC v3.9.1 stage"}}) {
    SCOPED_TRACE(name);
    fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick, kind));
    const StageSetup setup = SetupOf(kind);
    GrblStage stage(OpenSerialPort(host.port(), 115200), setup, kClock);
    EXPECT_THAT(stage.identity(), HasSubstr(name));
    stage.Home(In(20));
    stage.MoveTo({0.025, 0.012}, In(20));
    EXPECT_NEAR(stage.Where().readback.x, 0.025, 1e-5);
    host.Inspect([origin = setup.axes[0].origin_mm](fakes::FakeDevice& device) {
      const auto& at = dynamic_cast<fakes::GrblMachine&>(device).motion().position();
      EXPECT_NEAR(at[0], origin + 25, 1e-6);
      EXPECT_NEAR(at[1], origin - 12, 1e-6);
    });
    host.Suffer("limit switch");
    EXPECT_THAT(stage.Where().lost, HasSubstr("ALARM:1,"));
    stage.Home(In(20));
  }
}

// FluidNC's machine space ends where homing leaves it, and its remedies are in a file.
TEST(GrblStage, RefusesAFluidNcThatIsNotTheLabs) {
  const auto refused = [](const std::map<int, double>& settings, double origin_mm) {
    fakes::PtyHost host(
        std::make_unique<fakes::GrblMachine>(Quick(settings), fakes::GrblKind::kFluidNc));
    StageSetup setup = TestSetup();
    for (Axis& axis : setup.axes) axis.origin_mm = origin_mm;
    return ErrorOf([&] { GrblStage stage(OpenSerialPort(host.port(), 115200), setup, kClock); });
  };
  EXPECT_EQ(refused({}, -68.5), "no error");  // up to 11.5 mm; Grbl's space would end at 0
  EXPECT_THAT(refused({}, -67.5), HasSubstr("-188 to 12 mm"));
  EXPECT_EQ(refused({{23, 3}}, 92.5), "no error");  // from 12.5 mm, upwards from its switches
  EXPECT_THAT(refused({{23, 3}}, 91.5), HasSubstr("12 to 212 mm"));
  EXPECT_THAT(refused({{20, 0}}, -68.5),
              testing::AllOf(HasSubstr("soft_limits: true"), HasSubstr("config.yaml")));
  EXPECT_THAT(refused({{13, 1}}, -68.5), HasSubstr("report_inches: false"));
}

TEST(GrblStage, APortsFirmwareIsNamedWhereItHasSaidSo) {
  for (const auto& [kind, name] : {std::pair{fakes::GrblKind::kGrbl, "Grbl 1.1h"},
                                   std::pair{fakes::GrblKind::kGrblHal, "grblHAL 1.1f"},
                                   std::pair{fakes::GrblKind::kFluidNc, "FluidNC v3.9.1"}}) {
    fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick, kind));
    EXPECT_EQ(IdentifyPort(host.port(), 115200).front().what, name);
    // A status report is the same from all of them, and nothing more is asked.
    EXPECT_EQ(IdentifyPort(host.port(), 115200).front().what, "Grbl, grblHAL or FluidNC, Alarm");
  }
}

// The machine goes where the axes' map says, and keeps the lab's speed.
TEST(GrblStage, MapsTheFilterPlaneOntoTheMachine) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick));
  GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  EXPECT_THAT(stage.identity(), testing::AllOf(HasSubstr("1.1h"), HasSubstr(host.port())));
  stage.Home(In(20));
  stage.MoveTo({0.025, 0.012}, In(20));
  host.Inspect([](fakes::FakeDevice& device) {
    const auto& at = dynamic_cast<fakes::GrblMachine&>(device).motion().position();
    EXPECT_NEAR(at[0], -75, 1e-6);
    EXPECT_NEAR(at[1], -112, 1e-6);
  });
}

// A process that died left the machine moving, or locked by an alarm: connecting brings it to rest.
TEST(GrblStage, ConnectingHaltsWhatStillMoves) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick));
  {
    GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
    stage.Home(In(20));
  }
  {
    const auto port = OpenSerialPort(host.port(), 115200);
    port->Write("G1X-180F2000\n", SecondsFromNow(1));
    LineReader lines(*port);
    while (lines.Next(SecondsFromNow(1)) != "ok") {
    }
    // Half a line, cut off by the death of its sender: never to be executed.
    port->Write("G1X-1", SecondsFromNow(1));
  }
  GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  const auto rest = [&] {
    double x = 0;
    host.Inspect([&](fakes::FakeDevice& device) {
      const auto& motion = dynamic_cast<fakes::GrblMachine&>(device).motion();
      EXPECT_TRUE(motion.empty());
      x = motion.position()[0];
    });
    return x;
  };
  EXPECT_GT(rest(), -180);
  EXPECT_FALSE(stage.Where().homed) << "another process' homing is not ours";
  host.Suffer("limit switch");
  EXPECT_FALSE(stage.Where().homed);
  stage.Home(In(20));
  EXPECT_TRUE(stage.Where().homed);
}

// At rest nobody asks for an alarm's number but the next look, and only the first hears it.
TEST(GrblStage, SaysWhatCostThePosition) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick));
  GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  for (const auto& [event, reason] :
       {std::pair{"limit switch", "ALARM:1"}, std::pair{"power cycle", "restarted"}}) {
    stage.Home(In(20));
    EXPECT_EQ(stage.Where().lost, "");
    host.Suffer(event);
    for (int look = 0; look < 2; ++look) {
      const StagePosition where = stage.Where();
      EXPECT_FALSE(where.homed);
      EXPECT_THAT(where.lost, HasSubstr(reason));
    }
    ErrorOf([&] { stage.MoveTo({0, 0}, In(20)); });
    EXPECT_THAT(stage.Where().lost, HasSubstr(reason)) << "the cause, not its consequences";
  }
  stage.Home(In(20));
  EXPECT_EQ(stage.Where().lost, "");
}

// gnea/grbl#773: an `ok` behind ALARM:9 must not be taken for a homed machine.
TEST(GrblStage, AFailedHomingIsAnError) {
  fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick));
  GrblStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  host.Suffer("cut switches");
  EXPECT_THAT(ErrorOf([&] { stage.Home(In(20)); }),
              testing::AllOf(HasSubstr("ALARM:9"), HasSubstr("switch"), HasSubstr("not homed")));
  EXPECT_FALSE(stage.Where().homed);
}

// The conversation of a move, to the byte, then the transcript of a limit switch (gnea/grbl#757).
TEST(GrblStage, SpeaksAsTheDocumentsSay) {
  auto script = std::make_unique<ScriptedStream>(Conversation({
      {"G21G90G94G53G1X-75.0000Y-112.0000F6000.000\n", "ok\r\n"},
      {"G4P0.01\n", "ok\r\n"},
      Report("Idle", "-75.000,-112.000"),
      Report("Idle", "-75.000,-112.000"),
      {"G21G90G94G53G1X-100.0000Y-100.0000F6000.000\n",
       "ok\r\nALARM:1\r\n[MSG:Reset to continue]\r\n"},
      {"!", ""},
  }));
  const ScriptedStream& peer = *script;
  GrblStage stage(std::move(script), TestSetup(), kClock);
  stage.Home(In(5));
  stage.MoveTo({0.025, 0.012}, In(5));
  EXPECT_THAT(ErrorOf([&] { stage.MoveTo({0, 0}, In(5)); }), HasSubstr("ALARM:1"));
  EXPECT_TRUE(peer.finished());
}

// However the line damages the bytes, the driver never claims a position that the machine does not
// have, and ends every call in time.
TEST(GrblStage, ABadLineNeverLeadsToAWrongPosition) {
  constexpr std::uint64_t kSeed = 4;
  int moved = 0, refused = 0;
  for (std::uint64_t trial = 0; trial < 8; ++trial) {
    SCOPED_TRACE(fmt::format("seed {} trial {}", kSeed, trial));
    fakes::PtyHost host(std::make_unique<fakes::GrblMachine>(kQuick), 4);
    LineFaults faults;
    const double rate = 0.004;
    faults.drop = trial % 4 == 0 ? rate : 0;
    faults.duplicate = trial % 4 == 1 ? rate : 0;
    faults.garble = trial % 4 == 2 ? rate : 0;
    faults.truncate = trial % 4 == 3 ? 0.05 : 0;
    faults.hang = trial % 4 == 3 ? 0.002 : 0;
    faults.delay = 0.1;
    try {
      GrblStage stage(std::make_unique<FaultyStream>(OpenSerialPort(host.port(), 115200), faults,
                                                     faults, kSeed + trial),
                      TestSetup(), kClock);
      stage.Home(In(2));
      for (int k = 0; k < 5; ++k) {
        const Vec2 target{0.01 * (k % 3), -0.012 * (k % 2)};
        stage.MoveTo(target, In(1));
        ++moved;
        host.Inspect([&](fakes::FakeDevice& device) {
          const auto& motion = dynamic_cast<fakes::GrblMachine&>(device).motion();
          EXPECT_TRUE(motion.empty());
          EXPECT_NEAR(motion.position()[0], -100 + 1000 * target.x, 0.005);
          EXPECT_NEAR(motion.position()[1], -100 - 1000 * target.y, 0.005);
        });
      }
    } catch (const HardwareError&) {
      ++refused;
    }
  }
  EXPECT_GT(moved, 0);
  EXPECT_GT(refused, 0) << "the line was too good to show anything";
}

}  // namespace
}  // namespace luxfield::hal::grbl
