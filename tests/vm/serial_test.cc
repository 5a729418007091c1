// The serial transport and the Grbl driver over the kernel's ftdi_sio and a USB adapter.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <future>
#include <sstream>

#include "luxfield/hal/drivers/gpiod/line_selector.h"
#include "luxfield/hal/drivers/gpiod/safety_inputs.h"
#include "luxfield/hal/drivers/grbl/grbl_stage.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/safety/safety_guard.h"
#include "luxfield/hal/transport/open_port.h"
#include "tests/hal/error_of.h"
#include "tests/vm/await.h"
#include "tests/vm/gpio_sim.h"
#include "tests/vm/serial_adapter.h"

namespace luxfield::hal {
namespace {

using testing::Contains;
using testing::HasSubstr;
using vm::Await;
using vm::SerialAdapter;

// The control requests that the kernel's driver sends the adapter, as usbmon saw them.
class Wire {
 public:
  // FTDI's vendor requests.
  static constexpr unsigned kModemLines = 1, kBaud = 3, kData = 4;
  struct Request {
    unsigned request, value;
    bool operator==(const Request&) const = default;
  };

  Wire() : file_(open("/sys/kernel/debug/usb/usbmon/0u", O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    EXPECT_GE(file_, 0);
  }
  ~Wire() { close(file_); }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  // Since the last call.
  std::vector<Request> Requests() {
    std::string text;
    std::array<char, 4096> chunk;
    for (ssize_t got; (got = read(file_, chunk.data(), chunk.size())) > 0;)
      text.append(chunk.data(), static_cast<std::size_t>(got));
    std::vector<Request> requests;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      // TAG TIME S Co:BUS:DEVICE:0 s 40 REQUEST VALUE ..., numbers in base 16
      const auto setup = line.find(" s 40 ");
      if (setup == line.npos || line.find(" S Co:") == line.npos) continue;
      Request request{};
      std::istringstream(line.substr(setup + 6)) >> std::hex >> request.request >> request.value;
      requests.push_back(request);
    }
    return requests;
  }

 private:
  int file_;
};

class KernelSerial : public testing::Test {
 protected:
  std::unique_ptr<grbl::GrblStage> OpenStage(double speed_m_per_s) {
    grbl::StageSetup setup;
    setup.limits = {{-0.08, -0.06}, {0.08, 0.06}, speed_m_per_s, 0, 0};
    setup.axes = {grbl::Axis{0, 1, -100}, grbl::Axis{1, -1, -100}};
    return std::make_unique<grbl::GrblStage>(OpenSerialPort(SerialAdapter::kPort, 115200), setup,
                                             clock_);
  }
  double In(double seconds) { return clock_->MonotonicSeconds() + seconds; }

  static constexpr double kFast = 0.1, kSlow = 0.0005;  // m/s; the controller's time runs 20 times
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  SerialAdapter adapter_;
};

TEST_F(KernelSerial, ThePortIsListedAndTakesARateAndRawData) {
  EXPECT_THAT(AttachedSerialPorts(), Contains(SerialAdapter::kPort));
  Wire wire;
  const auto port = OpenSerialPort(SerialAdapter::kPort, 115200);
  const auto sent = wire.Requests();
  // FT232BM: 3 MHz / 26; 8 data bits, no parity, 1 stop bit; DTR and RTS up.
  EXPECT_THAT(sent, Contains(Wire::Request{Wire::kBaud, 26}));
  EXPECT_THAT(sent, Contains(Wire::Request{Wire::kData, 8}));
  EXPECT_THAT(sent, Contains(Wire::Request{Wire::kModemLines, 0x0303}));
  const HardwareError busy = ErrorOf([] { OpenSerialPort(SerialAdapter::kPort, 115200); });
  EXPECT_EQ(busy.fault, Fault::kRefused);
  EXPECT_THAT(busy.what(), HasSubstr("in use by another program"));
}

TEST_F(KernelSerial, ClosingLeavesTheModemLinesUp) {
  auto port = OpenSerialPort(SerialAdapter::kPort, 115200);
  Wire wire;
  port.reset();
  for (const Wire::Request& request : wire.Requests())
    EXPECT_NE(request.request, Wire::kModemLines) << "value " << request.value;
}

TEST_F(KernelSerial, AStageHomesAndMoves) {
  const auto stage = OpenStage(kFast);
  EXPECT_THAT(stage->identity(), testing::MatchesRegex("Grbl 1.1h.* stage on /dev/ttyUSB0"));
  stage->Home(In(60));
  stage->MoveTo({0.025, 0.012}, In(60));
  std::vector<double> answer_ms;
  for (int k = 0; k < 21; ++k) {
    const double begin_s = clock_->MonotonicSeconds();
    const StagePosition position = stage->Where();
    answer_ms.push_back(1e3 * (clock_->MonotonicSeconds() - begin_s));
    EXPECT_TRUE(position.homed);
    EXPECT_NEAR(position.readback.x, 0.025, 1e-5);
    EXPECT_NEAR(position.readback.y, 0.012, 1e-5);
  }
  std::sort(answer_ms.begin(), answer_ms.end());
  fmt::print("question to answer: median {:.1f} ms, worst {:.1f} ms\n", answer_ms[10],
             answer_ms.back());
}

TEST_F(KernelSerial, APulledCableEndsTheMoveAndLosesThePosition) {
  {
    const auto stage = OpenStage(kSlow);
    stage->Home(In(60));
    auto moving = std::async(std::launch::async, [&] {
      return ErrorOf([&] { stage->MoveTo({0.08, 0}, In(300)); });
    });
    ASSERT_TRUE(Await([&] { return stage->Where().moving; }));
    adapter_.Unplug();
    const HardwareError error = moving.get();
    EXPECT_EQ(error.fault, Fault::kDisconnected);
    EXPECT_TRUE(error.position_lost);
    EXPECT_THAT(error.what(), HasSubstr("/dev/ttyUSB0"));
    EXPECT_EQ(ErrorOf([&] { stage->MoveTo({0, 0}, In(10)); }).fault, Fault::kNotHomed);
    EXPECT_EQ(ErrorOf([&] { stage->Home(In(10)); }).fault, Fault::kDisconnected);
    EXPECT_EQ(ErrorOf([&] { OpenStage(kSlow); }).fault, Fault::kDisconnected);
  }
  adapter_.Plug();
  const auto stage = OpenStage(kFast);
  EXPECT_FALSE(stage->Where().homed);
  EXPECT_EQ(ErrorOf([&] { stage->MoveTo({0, 0}, In(10)); }).fault, Fault::kNotHomed);
  stage->Home(In(60));
  stage->MoveTo({0.01, 0}, In(60));
  EXPECT_NEAR(stage->Where().readback.x, 0.01, 1e-5);
}

TEST_F(KernelSerial, TheEmergencyStopStopsTheMoveAndDarkensTheLamp) {
  vm::GpioSim chip({"stop", "lamp"});
  Devices devices;
  devices.clock = clock_;
  devices.stage = OpenStage(kSlow);
  devices.supply = std::make_unique<gpiod::LampRelay>(chip.chip(), gpiod::LineSettings{"lamp"});
  gpiod::SafetyInputsOptions options;
  options.chip = chip.chip();
  options.emergency_stop = gpiod::LineSettings{"stop"};
  devices.inputs = std::make_unique<gpiod::SafetyInputs>(options);
  SafetyGuard guard(devices);
  guard.SwitchLampOn(In(10));
  devices.stage->Home(In(60));
  auto moving = std::async(std::launch::async, [&] {
    return ErrorOf([&] { devices.stage->MoveTo({0.08, 0}, In(300)); });
  });
  ASSERT_TRUE(Await([&] { return devices.stage->Where().moving; }));
  EXPECT_TRUE(chip.Pin("lamp"));
  chip.SetPin("stop", true);
  const HardwareError error = moving.get();
  EXPECT_EQ(error.fault, Fault::kStopped);
  EXPECT_TRUE(Await([&] { return !chip.Pin("lamp"); }));
  EXPECT_FALSE(devices.stage->Where().moving);
  EXPECT_EQ(ErrorOf([&] { guard.ThrowIfUnsafe(); }).fault, Fault::kStopped);
}

}  // namespace
}  // namespace luxfield::hal
