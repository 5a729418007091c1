// The GPIO drivers over the kernel's own GPIO interface, with either version of libgpiod.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/gpio.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <future>

#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/drivers/gpiod/line_selector.h"
#include "luxfield/hal/drivers/gpiod/safety_inputs.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/safety/safety_guard.h"
#include "tests/hal/error_of.h"
#include "tests/vm/await.h"
#include "tests/vm/gpio_sim.h"

namespace luxfield::hal::gpiod {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using vm::Await;

std::uint64_t MonotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u +
         static_cast<std::uint64_t>(now.tv_nsec);
}

struct Edge {
  std::uint64_t time_ns;
  bool rising;
};

#if LUXFIELD_LIBGPIOD == 2
using KernelEdge = gpio_v2_line_event;
std::uint64_t TimeOf(const KernelEdge& edge) { return edge.timestamp_ns; }
#else
using KernelEdge = gpioevent_data;
std::uint64_t TimeOf(const KernelEdge& edge) { return edge.timestamp; }
#endif

// What the kernel has queued, as it wrote it.
std::vector<Edge> QueuedEdges(int fd) {
  std::vector<Edge> edges;
  KernelEdge edge{};
  for (pollfd ready{fd, POLLIN, 0};
       poll(&ready, 1, 0) == 1 && read(fd, &edge, sizeof edge) == sizeof edge;)
    edges.push_back({TimeOf(edge), edge.id == GPIOEVENT_EVENT_RISING_EDGE});
  return edges;
}

class KernelGpio : public testing::Test {
 protected:
  SafetyInputsOptions EmergencyStop() const {
    SafetyInputsOptions options;
    options.chip = chip_.chip();
    options.emergency_stop = LineSettings{"stop"};
    return options;
  }

  vm::GpioSim chip_{{"shutter", "lamp", "stop", "door"}};
};

TEST_F(KernelGpio, ChipsAndLinesAreFoundAndLevelsRead) {
  EXPECT_THAT(DescribeChip(chip_.chip()), HasSubstr("4 lines"));
  chip_.SetPin("door", true);
  const InputLines lines(chip_.chip(), {{"stop"}, {"3"}, {"shutter", true}});
  EXPECT_THAT(lines.Levels(), ElementsAre(false, true, true));
  chip_.SetPin("stop", true);
  chip_.SetPin("door", false);
  chip_.SetPin("shutter", true);
  EXPECT_THAT(lines.Levels(), ElementsAre(true, false, false));
}

TEST_F(KernelGpio, OutputsDriveTheirPins) {
  OutputLine shutter("/dev/" + chip_.chip(), {"shutter"}, true);
  EXPECT_TRUE(chip_.Pin("shutter"));
  shutter.Set(false);
  EXPECT_FALSE(chip_.Pin("shutter"));
  EXPECT_FALSE(shutter.Get());
  OutputLine lamp(chip_.chip(), {"lamp", true}, false);
  EXPECT_TRUE(chip_.Pin("lamp"));
  lamp.Set(true);
  EXPECT_FALSE(chip_.Pin("lamp"));
  EXPECT_TRUE(lamp.Get());
}

TEST_F(KernelGpio, EdgesCarryTheTimeTheyHappened) {
  InputLines lines(chip_.chip(), {{"stop"}});
  const std::uint64_t before_ns = MonotonicNs();
  chip_.SetPin("stop", true);
  chip_.SetPin("stop", false);
  const std::uint64_t after_ns = MonotonicNs();
  const auto edges = QueuedEdges(lines.edge_fds().at(0));
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_TRUE(edges[0].rising);
  EXPECT_FALSE(edges[1].rising);
  EXPECT_LE(before_ns, edges[0].time_ns);
  EXPECT_LE(edges[0].time_ns, edges[1].time_ns);
  EXPECT_LE(edges[1].time_ns, after_ns);
}

TEST_F(KernelGpio, OfABurstSixteenEdgesAreKeptAndTheLevelIsRead) {
  InputLines lines(chip_.chip(), {{"stop"}});
  const auto burst = [&] {
    for (int k = 0; k < 41; ++k) chip_.SetPin("stop", k % 2 == 0);
  };
  burst();
  const auto edges = QueuedEdges(lines.edge_fds().at(0));
  EXPECT_EQ(edges.size(), 16u);
  EXPECT_THAT(lines.Levels(), ElementsAre(true));
  chip_.SetPin("stop", false);
  burst();
  lines.DrainEdges();
  EXPECT_TRUE(QueuedEdges(lines.edge_fds().at(0)).empty());
  EXPECT_THAT(lines.Levels(), ElementsAre(true));
}

// A process that holds a line until it is told to end.
class Holder {
 public:
  Holder(const std::string& chip, const std::string& line) {
    EXPECT_EQ(pipe(held_), 0);
    EXPECT_EQ(pipe(end_), 0);
    child_ = fork();
    if (child_ == 0) {
      const OutputLine output(chip, {line}, false);
      char byte = 0;
      [[maybe_unused]] ssize_t moved = write(held_[1], &byte, 1);
      close(end_[1]);
      moved = read(end_[0], &byte, 1);
      _exit(0);
    }
    char byte = 0;
    EXPECT_EQ(read(held_[0], &byte, 1), 1);
  }
  ~Holder() {
    close(end_[1]);
    waitpid(child_, nullptr, 0);
    for (const int fd : {held_[0], held_[1], end_[0]}) close(fd);
  }

 private:
  int held_[2]{}, end_[2]{};
  pid_t child_ = -1;
};

TEST_F(KernelGpio, ALineThatAnotherProcessHoldsIsNamedAndSoIsWhoHoldsIt) {
  {
    const Holder holder(chip_.chip(), "lamp");
    for (const HardwareError& error :
         {ErrorOf([&] { OutputLine(chip_.chip(), {"lamp"}, false); }), ErrorOf([&] {
            InputLines(chip_.chip(), {{"stop"}, {"lamp"}});
          })}) {
      EXPECT_EQ(error.fault, Fault::kRefused);
      EXPECT_THAT(error.what(), HasSubstr("line lamp is held by \"luxfield\""));
    }
  }
  // The kernel frees what a process held.
  EXPECT_NO_THROW(OutputLine(chip_.chip(), {"lamp"}, false));
}

// Counts trips.
struct Trips {
  std::atomic<int> count = 0;
  Inputs::Action action() {
    return [this](const InputState&) { ++count; };
  }
};

TEST_F(KernelGpio, ABouncingContactTripsOnce) {
  SafetyInputsOptions options = EmergencyStop();
  options.release_s = 600;  // long against what a busy machine takes between two edges
  SafetyInputs inputs(options);
  Trips trips;
  inputs.OnTrip(trips.action());
  for (int k = 0; k < 101; ++k) chip_.SetPin("stop", k % 2 == 0);  // ends open
  EXPECT_TRUE(Await([&] { return trips.count > 0; }));
  EXPECT_TRUE(inputs.State().emergency_stop);
  EXPECT_EQ(trips.count, 1);
}

TEST_F(KernelGpio, ASpikeDoesNotTrip) {
  SafetyInputsOptions options = EmergencyStop();
  options.door = LineSettings{"door"};
  options.assert_s = 2;  // long against what a busy machine takes between two edges
  SafetyInputs inputs(options);
  Trips trips;
  inputs.OnTrip(trips.action());
  chip_.SetPin("stop", true);
  chip_.SetPin("stop", false);
  // What opens after the spike trips after it would have.
  chip_.SetPin("door", true);
  EXPECT_TRUE(Await([&] { return trips.count > 0; }));
  EXPECT_TRUE(inputs.State().door_open);
  EXPECT_FALSE(inputs.State().emergency_stop);
  EXPECT_EQ(trips.count, 1);
}

// A stage that notes when it is told to stop.
class ToldStage : public Stage {
 public:
  std::string identity() const override { return "told stage"; }
  StageLimits limits() const override { return {}; }
  void Home(double) override {}
  void MoveTo(Vec2, double) override {}
  StagePosition Where() override { return {}; }
  void Stop() override { stopped.set_value(MonotonicNs()); }

  std::promise<std::uint64_t> stopped;
};

TEST_F(KernelGpio, AnOpenedEmergencyStopStopsTheStageAndDarkensTheLamp) {
  Devices devices;
  devices.clock = std::make_shared<core::SystemClock>();
  auto told = std::make_unique<ToldStage>();
  ToldStage& stage = *told;
  devices.stage = std::move(told);
  devices.supply = std::make_unique<LampRelay>(chip_.chip(), LineSettings{"lamp"});
  SafetyInputsOptions options = EmergencyStop();
  options.release_s = 0.003;
  devices.inputs = std::make_unique<SafetyInputs>(options);
  std::vector<double> stop_ms, dark_ms;
  for (int trial = 0; trial < 20; ++trial) {
    SafetyGuard guard(devices);
    stage.stopped = {};
    guard.SwitchLampOn(devices.clock->MonotonicSeconds() + 10);
    ASSERT_TRUE(chip_.Pin("lamp"));
    const std::uint64_t edge_ns = MonotonicNs();
    chip_.SetPin("stop", true);
    ASSERT_TRUE(Await([&] { return !chip_.Pin("lamp"); }));
    dark_ms.push_back(1e-6 * static_cast<double>(MonotonicNs() - edge_ns));
    stop_ms.push_back(1e-6 * static_cast<double>(stage.stopped.get_future().get() - edge_ns));
    EXPECT_EQ(ErrorOf([&] { guard.ThrowIfUnsafe(); }).fault, Fault::kStopped);
    chip_.SetPin("stop", false);
    ASSERT_TRUE(Await([&] { return devices.inputs->State().safe(); }));
  }
  std::sort(stop_ms.begin(), stop_ms.end());
  std::sort(dark_ms.begin(), dark_ms.end());
  fmt::print(
      "stage told to stop: median {:.1f} ms, worst {:.1f} ms after the edge; lamp seen dark: "
      "median {:.1f} ms, worst {:.1f} ms\n",
      stop_ms[10], stop_ms.back(), dark_ms[10], dark_ms.back());
}

TEST_F(KernelGpio, ALampRelayIsReleasedDarkWhenItsProcessIsKilled) {
  int lit[2];
  ASSERT_EQ(pipe(lit), 0);
  const pid_t child = fork();
  if (child == 0) {
    OutputLine lamp(chip_.chip(), {"lamp"}, true);
    char byte = 0;
    [[maybe_unused]] const ssize_t put = write(lit[1], &byte, 1);
    for (;;) pause();
  }
  char byte = 0;
  ASSERT_EQ(read(lit[0], &byte, 1), 1);
  EXPECT_TRUE(chip_.Pin("lamp"));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  // Free for the watchdog at once, and dark after it.
  { LampRelay relay(chip_.chip(), LineSettings{"lamp"}); }
  EXPECT_FALSE(chip_.Pin("lamp"));
  for (const int fd : lit) close(fd);
}

TEST_F(KernelGpio, AnAdapterThatIsPulledOutIsUnsafe) {
  SafetyInputs inputs(EmergencyStop());
  Trips trips;
  inputs.OnTrip(trips.action());
  OutputLine lamp(chip_.chip(), {"lamp"}, true);
  chip_.Unplug();
  EXPECT_TRUE(Await([&] { return trips.count > 0; }));
  EXPECT_THAT(Describe(inputs.State()), HasSubstr("cannot be read"));
  EXPECT_EQ(ErrorOf([&] { lamp.Set(false); }).fault, Fault::kDisconnected);
  EXPECT_EQ(ErrorOf([&] { DescribeChip(chip_.chip()); }).fault, Fault::kDisconnected);
}

}  // namespace
}  // namespace luxfield::hal::gpiod
