// The Zaber codec, the fake chain and the driver. Lines marked "maker's" are from the tests of the
// maker's own Python library (zaber.serial: test_asciireply.py, test_asciidevice.py).
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "luxfield/hal/drivers/zaber/message.h"
#include "luxfield/hal/drivers/zaber/zaber_stage.h"
#include "luxfield/hal/transport/open_port.h"
#include "luxfield/hal/transport/scripted_stream.h"
#include "tests/fakes/pty_host.h"
#include "tests/fakes/zaber_chain.h"
#include "tests/fuzz/seeded.h"
#include "tests/fuzz/zaber_message.h"

namespace luxfield::hal::zaber {
namespace {

using testing::HasSubstr;

template <typename Kind>
Kind Parsed(const std::string& line) {
  const Message message = ParseMessage(line);
  if (!std::holds_alternative<Kind>(message)) {
    ADD_FAILURE() << line << " is taken for another kind of message";
    return {};
  }
  return std::get<Kind>(message);
}

TEST(ZaberMessage, ParsesTheMakersExamples) {
  const auto plain = Parsed<Reply>("@01 0 OK IDLE -- 0");
  EXPECT_EQ(plain.device, 1);
  EXPECT_EQ(plain.axis, 0);
  EXPECT_TRUE(plain.accepted);
  EXPECT_FALSE(plain.busy);
  EXPECT_EQ(plain.warning, "--");
  EXPECT_EQ(plain.data, "0");
  EXPECT_FALSE(plain.id);
  const auto numbered = Parsed<Reply>("@04 2 12 OK IDLE -- 123");
  EXPECT_EQ(numbered.device, 4);
  EXPECT_EQ(numbered.axis, 2);
  EXPECT_EQ(numbered.id, 12);
  EXPECT_EQ(numbered.data, "123");
  EXPECT_EQ(Parsed<Reply>("@01 0 OK BUSY -- 10000 10001").data, "10000 10001");
  const auto rejected = Parsed<Reply>("@01 0 RJ IDLE WR BADDATA");
  EXPECT_FALSE(rejected.accepted);
  EXPECT_EQ(rejected.data, "BADDATA");
  const auto alert = Parsed<Alert>("!01 0 IDLE --");
  EXPECT_EQ(alert.device, 1);
  EXPECT_FALSE(alert.busy);
  Parsed<Other>("#01 0 Visit www.zaber.com for instruction manuals.");
}

TEST(ZaberMessage, ChecksumsAreTheMakers) {
  EXPECT_EQ(Checksum("01 0 OK IDLE -- 0"), 0x8D);
  EXPECT_EQ(Checksum("01 0 OK IDLE -- 7z"), 0x0C);
  EXPECT_EQ(Parsed<Reply>("@01 0 OK IDLE -- 0:8D").data, "0");
  Parsed<Other>("@01 0 OK IDLE -- 0:8E");
  Parsed<Other>("@01 0 OK IDLE -- 0:GG");
  const std::string command = Command(1, 2, 5, "move abs 1000");
  EXPECT_THAT(command, testing::StartsWith("/1 2 5 move abs 1000:"));
  EXPECT_EQ(Checksum(command.substr(1, command.size() - 5)),
            std::stoi(command.substr(command.size() - 3), nullptr, 16));
  EXPECT_THAT(Command(1, 1, 7, ""), testing::StartsWith("/1 1 7:"));
}

TEST(ZaberMessage, RefusesWhatTheMakersLibraryRefuses) {
  for (const char* line :
       {"%33 A OK I AM A BANANA", "4", "#BD 4 !! ", "@01 0 OK IDLE --", "@01 0 OK IDLE -- ", "",
        "@", "@01 0 NO IDLE -- 0", "@01 0 OK LAZY -- 0", "@-1 0 OK IDLE -- 0", "!01 0 IDLE"})
    Parsed<Other>(line);
}

TEST(ZaberMessage, SurvivesASampleOfFuzzing) {
  fuzz::Seeded(fuzz::ZaberMessage, {"@01 0 12 OK BUSY WR 10000:8D\r\n", "!01 0 IDLE FS\n",
                                    "@02 1 RJ IDLE -- BADDATA\n", "#01 0 info\n"});
}

std::string Say(fakes::ZaberChain& chain, const std::string& bytes, double seconds = 0) {
  chain.Receive(bytes);
  chain.Advance(seconds);
  return chain.Transmit();
}

// The maker's conversations: home, move, stop.
TEST(ZaberChain, AnswersAsTheMakerRecords) {
  fakes::ZaberChain chain;
  EXPECT_EQ(Say(chain, "/1 0 home\r\n"), "@01 0 OK BUSY WR 0\r\n");
  EXPECT_EQ(Say(chain, "/1 0\r\n"), "@01 0 OK BUSY WR 0\r\n");
  chain.Advance(10);
  EXPECT_EQ(Say(chain, "/1 0\r\n"), "@01 0 OK IDLE -- 0\r\n");
  EXPECT_EQ(Say(chain, "/1 0 move abs 100000\r\n"), "@01 0 OK BUSY -- 0\r\n");
  EXPECT_EQ(Say(chain, "/1 0 stop\r\n"), "@01 0 OK IDLE NI 0\r\n");
  EXPECT_EQ(Say(chain, "/1 0 get nonsense\r\n"), "@01 0 RJ IDLE NI BADCOMMAND\r\n");
  EXPECT_EQ(Say(chain, "/1 0 move abs -1\r\n"), "@01 0 RJ IDLE NI BADDATA\r\n");
  EXPECT_EQ(Say(chain, "/get deviceid\r\n"),
            "@01 0 OK IDLE NI 50001\r\n@02 0 OK IDLE WR 50002\r\n");
  EXPECT_EQ(Say(chain, "/1 0 12 get deviceid\r\n"), "@01 0 12 OK IDLE NI 50001\r\n");
  EXPECT_EQ(Say(chain, "/3 0 home\r\n"), "") << "nobody has this address";
  EXPECT_EQ(Say(chain, "/1 0 home:00\r\n"), "") << "a wrong checksum";
}

const std::shared_ptr<core::Clock> kClock = std::make_shared<core::SystemClock>();
double In(double seconds) { return kClock->MonotonicSeconds() + seconds; }

StageSetup TestSetup() {
  StageSetup setup;
  setup.limits = {{-0.08, -0.06}, {0.08, 0.06}, 0.2, 0, 0};
  setup.axes = {Axis{1, 1, 1, 0.1, 5e-8}, Axis{2, 1, -1, 0.1, 5e-8}};
  return setup;
}

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const HardwareError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ZaberStage, MapsTheFilterPlaneOntoMicrosteps) {
  fakes::PtyHost host(std::make_unique<fakes::ZaberChain>(), 4);
  ZaberStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  EXPECT_THAT(stage.identity(), HasSubstr("50001 and 50002"));
  stage.Home(In(20));
  stage.MoveTo({0.025, 0.012}, In(20));
  host.Inspect([](fakes::FakeDevice& device) {
    const auto& chain = dynamic_cast<fakes::ZaberChain&>(device);
    EXPECT_NEAR(chain.position(0), 0.125 / 5e-8, 0.5);
    EXPECT_NEAR(chain.position(1), 0.088 / 5e-8, 0.5);
  });
}

TEST(ZaberStage, SaysWhatCostThePosition) {
  fakes::PtyHost host(std::make_unique<fakes::ZaberChain>(), 4);
  ZaberStage stage(OpenSerialPort(host.port(), 115200), TestSetup(), kClock);
  for (const auto& [event, reason] :
       {std::pair{"limit switch", "warns FX"}, std::pair{"power cycle", "warns WR"}}) {
    stage.Home(In(20));
    EXPECT_EQ(stage.Where().lost, "");
    host.Suffer(event);
    for (int look = 0; look < 2; ++look) {
      const StagePosition where = stage.Where();
      EXPECT_FALSE(where.homed);
      EXPECT_THAT(where.lost, HasSubstr(reason));
    }
  }
}

TEST(ZaberStage, RefusesAStageThatIsNotTheLabs) {
  fakes::PtyHost host(std::make_unique<fakes::ZaberChain>());
  const auto connecting = [&](const StageSetup& setup) {
    return ErrorOf([&] { ZaberStage stage(OpenSerialPort(host.port(), 115200), setup, kClock); });
  };
  EXPECT_EQ(connecting(TestSetup()), "no error");
  StageSetup setup = TestSetup();
  setup.axes[1].origin_m = 0.05;  // v up to 0.06 m would end before the reference
  EXPECT_THAT(connecting(setup), HasSubstr("origin_m"));
  setup = TestSetup();
  setup.limits.speed_m_per_s = 1;
  EXPECT_THAT(connecting(setup), HasSubstr("BADDATA"));
  setup = TestSetup();
  setup.axes[1].number = 2;
  EXPECT_THAT(connecting(setup), HasSubstr("BADAXIS"));
}

}  // namespace
}  // namespace luxfield::hal::zaber
