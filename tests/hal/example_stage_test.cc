// The example of docs/adding-a-driver.md: a stage driver for a controller that answers every line
// with `at X Y idle|busy homed|lost`, in micrometres; and its instantiation of the conformance
// suite.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "luxfield/core/file.h"
#include "tests/fakes/pty_host.h"
#include "tests/hal/stage_conformance.h"

// example: driver
#include <fmt/format.h>

#include <sstream>

#include "luxfield/hal/transport/controller_stage.h"
#include "luxfield/hal/transport/line_reader.h"
#include "luxfield/hal/transport/open_port.h"

namespace luxfield::hal {

class ToyStage final : public ControllerStage {
 public:
  ToyStage(std::unique_ptr<ByteStream> port, const StageLimits& limits,
           std::shared_ptr<core::Clock> clock)
      : ControllerStage(limits, std::move(clock)), port_(std::move(port)), lines_(*port_) {
    SetResolution(1e-6);
    Connect(5, [](const Operation&) {});
  }
  std::string identity() const override { return "toy stage on " + port_->name(); }

 private:
  struct Answer {
    Vec2 at_m;
    bool busy = false, homed = false;
  };

  bool Halt(const Operation& operation) override {
    Answer answer = Ask(operation, "stop");
    while (answer.busy) answer = AskAgain(operation);
    return answer.homed;
  }

  void DriveHome(const Operation& operation) override {
    Ask(operation, "home");
    if (!WaitUntilIdle(operation).homed)
      throw Failure(operation, Fault::kNotHomed, "no reference mark found", "check its sensors");
  }

  void DriveTo(const Operation& operation, Vec2 centre) override {
    AskPosition(operation);  // nothing moves that has lost its reference
    Ask(operation, fmt::format("move {:.0f} {:.0f}", 1e6 * centre.x, 1e6 * centre.y));
    const Vec2 at = WaitUntilIdle(operation).at_m;
    if (std::hypot(at.x - centre.x, at.y - centre.y) > 1e-6)
      throw Failure(operation, Fault::kProtocol, "stands elsewhere", "check the cable, then home");
  }

  void AskPosition(const Operation& operation) override {
    if (!Ask(operation, "where").homed)
      throw Failure(operation, Fault::kNotHomed, "has lost its reference", "home it");
  }

  void SendStop(bool, SteadyTime deadline) override { port_->Write("stop\n", deadline); }

  Answer Ask(const Operation& operation, const std::string& command) {
    while (lines_.Next(std::chrono::steady_clock::now())) {
    }  // answers to stops from other threads
    port_->Write(command + "\n", operation.deadline);
    const auto line = lines_.Next(operation.deadline);
    if (!line)
      throw Failure(operation, Fault::kTimeout, "no answer to " + command,
                    "check power and cable, then home");
    std::istringstream words(*line);
    std::string at, busy, homed;
    double x_um = 0, y_um = 0;
    if (!(words >> at >> x_um >> y_um >> busy >> homed))
      throw Failure(operation, Fault::kProtocol, "answers \"" + *line + "\"", "check the cable");
    const Answer answer{{1e-6 * x_um, 1e-6 * y_um}, busy == "busy", homed == "homed"};
    Heard(answer.at_m, answer.busy);
    return answer;
  }

  Answer AskAgain(const Operation& operation) {
    const SteadyTime question = std::min(operation.deadline, SecondsFromNow(0.02));
    while (lines_.Next(question)) {
    }
    return Ask(operation, "where");
  }

  Answer WaitUntilIdle(const Operation& operation) {
    for (;;) {
      const Answer answer = AskAgain(operation);
      ThrowIfStopped(operation);
      if (!answer.homed && !homing())
        throw Failure(operation, Fault::kStopped, "has lost its reference", "home it", true);
      if (!answer.busy) return answer;
    }
  }

  std::unique_ptr<ByteStream> port_;
  LineReader lines_;
};

}  // namespace luxfield::hal
// example: end

namespace luxfield::hal {
namespace {

// The controller that the driver talks to.
class ToyController : public fakes::FakeDevice {
 public:
  void Receive(std::string_view bytes) override {
    for (const char c : bytes)
      if (c == '\n')
        Execute(std::exchange(line_, {}));
      else
        line_ += c;
  }
  void Advance(double seconds) override {
    bool moving = false;
    for (int k = 0; k < 2; ++k) {
      const double left = target_[k] - at_[k], step = kSpeed_um_per_s * seconds;
      at_[k] += std::clamp(left, -step, step);
      moving = moving || std::abs(left) > step;
    }
    if (!moving && std::exchange(homing_, false)) homed_ = true;
    busy_ = moving;
  }
  std::string Transmit() override { return std::exchange(out_, {}); }
  bool active() const override { return busy_; }
  bool Suffer(std::string_view event) override {
    if (event != "power cycle" && event != "limit switch") return false;
    target_ = at_;
    homed_ = homing_ = busy_ = false;
    return true;
  }

 private:
  static constexpr double kSpeed_um_per_s = 1e5;

  void Execute(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "stop") {
      target_ = at_;
      homing_ = false;
    } else if (command == "home") {
      target_ = {-1000, -1000};
      homed_ = false;
      homing_ = busy_ = true;
    } else if (command == "move" && homed_) {
      words >> target_[0] >> target_[1];
      busy_ = true;
    }
    if (command == "stop") busy_ = false;
    out_ += fmt::format("at {:.0f} {:.0f} {} {}\n", at_[0], at_[1], busy_ ? "busy" : "idle",
                        homed_ ? "homed" : "lost");
  }

  std::string line_, out_;
  std::array<double, 2> at_{-4000, -3000}, target_{-4000, -3000};
  bool busy_ = false, homing_ = false, homed_ = false;
};

// example: bench
class ToyBench : public StageBench {
 public:
  Stage& stage() override { return stage_; }
  core::Clock& clock() override { return *clock_; }
  bool Freeze(bool frozen) override {
    host_.Freeze(frozen);
    return true;
  }
  bool Restart() override { return host_.Suffer("power cycle"); }
  bool HitLimitSwitch() override { return host_.Suffer("limit switch"); }
  bool InMotion() override {
    bool moves = false;
    host_.Inspect([&](fakes::FakeDevice& device) { moves = device.active(); });
    return moves;
  }

 private:
  fakes::PtyHost host_{std::make_unique<ToyController>()};
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  ToyStage stage_{OpenSerialPort(host_.port(), 115200),
                  StageLimits{{-0.02, -0.015}, {0.02, 0.015}, 0.1, 0.01, 0}, clock_};
};

INSTANTIATE_TEST_SUITE_P(Example, StageConformance,
                         testing::Values(StageDriver{"toy",
                                                     [] { return std::make_unique<ToyBench>(); }}),
                         NameOfDriver);
// example: end

// The page shows this file's code, to the letter.
TEST(Example, TheDocumentShowsWhatIsTested) {
  const std::string root = LUXFIELD_SOURCE_DIR;
  const std::string page = core::ReadFile(root + "/docs/adding-a-driver.md");
  const std::string file = core::ReadFile(root + "/tests/hal/example_stage_test.cc");
  for (const std::string part : {"driver", "bench"}) {
    const std::string mark = "// example: " + part + "\n";
    const auto begin = file.find(mark) + mark.size();
    const std::string code = file.substr(begin, file.find("// example: end", begin) - begin);
    EXPECT_THAT(page, testing::HasSubstr("```cpp\n" + code + "```\n")) << part;
  }
}

}  // namespace
}  // namespace luxfield::hal
