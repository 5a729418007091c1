#include "tests/lab/fake_bench.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <stdexcept>

#include "luxfield/core/config.h"
#include "luxfield/hal/sim/lab_description.h"
#include "tests/e2e/program.h"
#include "tests/fakes/grbl_machine.h"

namespace luxfield::bench {
namespace {

constexpr const char* kSerial = "LUXBENCH";
constexpr int kSupplyProduct = 1, kMeterProduct = 2;
constexpr double kOrigin_mm = -150;  // machine coordinates of the filter's central place
constexpr double kSpeedUp = 20;      // of the stage

// A controller with 300 mm of travel that homes fast.
std::unique_ptr<fakes::FakeDevice> Controller() {
  return std::make_unique<fakes::GrblMachine>(std::map<int, double>{{110, 6000},
                                                                    {111, 6000},
                                                                    {120, 1000},
                                                                    {121, 1000},
                                                                    {24, 1000},
                                                                    {25, 6000},
                                                                    {130, 300},
                                                                    {131, 300}});
}

bool SetLoopback(bool up) {
  ifreq loopback{};
  loopback.ifr_name[0] = 'l';
  loopback.ifr_name[1] = 'o';
  loopback.ifr_flags = static_cast<short>(up ? IFF_UP | IFF_RUNNING : 0);
  const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool done = ioctl(any, SIOCSIFFLAGS, &loopback) == 0;
  close(any);
  return done;
}

// Cameras of GigE Vision answer on one port, 3956: the loopback interface of this process and of
// those it starts becomes their own, where the system lets it (false: it does not), so that several
// test programs can run at a time. Before other threads exist: they stay where they are.
bool UseANetworkOfOurOwn() {
  static const bool done = [] {
    const uid_t user = getuid();
    const gid_t group = getgid();
    if (unshare(CLONE_NEWNET) != 0) {
      if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
      e2e::WriteText("/proc/self/setgroups", "deny");
      e2e::WriteText("/proc/self/uid_map", fmt::format("{0} {0} 1", user));
      e2e::WriteText("/proc/self/gid_map", fmt::format("{0} {0} 1", group));
    }
    if (!SetLoopback(true)) throw std::runtime_error("the loopback interface stays down");
    return true;
  }();
  return done;
}

// The carriage has the controller's coordinates once that is homed; y runs against v.
void PlaceFilter(fakes::FakeDevice& device, fakes::BenchState& state) {
  const auto& at = dynamic_cast<fakes::GrblMachine&>(device).motion().carriage();
  state.u_m = 1e-3 * (at[0] - kOrigin_mm);
  state.v_m = -1e-3 * (at[1] - kOrigin_mm);
}

}  // namespace

FakeBench::FakeBench(const std::filesystem::path& folder, const std::filesystem::path& world,
                     CameraKind camera)
    : kind_(camera),
      world_(world),
      state_file_(folder / "bench.state"),
      state_(state_file_, true),
      lamp_time_(hal::sim::ReadLab(core::Config::FromFile(world), {}).lamp_time),
      testbed_((UseANetworkOfOurOwn(), umockdev_testbed_new())),
      stage_(Controller(), kSpeedUp,
             [this](fakes::FakeDevice& device) { PlaceFilter(device, *state_); }),
      chip_(
          testbed_,
          {"e-stop", "door", "shutter", "plus", "minus", "at-plus", "at-minus", "lamp", "trigger"},
          hal::gpiod::FakeGpioChip::Users::kOtherProcesses),
      supply_(std::make_unique<hal::usbtmc::FakeInstrument>(
          testbed_, kSupplyProduct,
          [this](const std::string& message) { return AnswerSupply(message); })),
      meter_(std::make_unique<hal::usbtmc::FakeInstrument>(
          testbed_, kMeterProduct,
          [this](const std::string& message) { return AnswerMeter(message); })) {
  chip_.Couple("plus", "at-plus");
  chip_.Couple("minus", "at-minus");
  chip_.OnOutput([this](const std::string& line, bool high) {
    if (line == "shutter") state_->shutter_open = high;
    if (line == "lamp") SwitchLamp(high);
    if (high && line == "trigger") RaiseCameraInput();
    if (high && (line == "plus" || line == "minus")) state_->print = line == "minus";
  });
  std::filesystem::remove(fakes::ExposureLogOf(state_file_));  // of a bench before
  // For the programs that are started from here on.
  if (const char* preload = std::getenv("LD_PRELOAD")) preload_before_ = preload;
  setenv("LD_PRELOAD",
         (e2e::BuiltProgram("line_descriptors.so").string() + ":" + preload_before_).c_str(), 1);
  StartCamera();
}

FakeBench::~FakeBench() {
  if (camera_ > 0) KillCamera();
  setenv("LD_PRELOAD", preload_before_.c_str(), 1);
  g_object_unref(testbed_);
}

std::string FakeBench::CameraKeys() const {
  const auto sensor = hal::sim::ReadLab(core::Config::FromFile(world_), {}).camera.sensor;
  if (kind_ == CameraKind::kStill)
    return fmt::format(
        "driver = \"gphoto2\"\nport = \"{}\"\nsize_px = [{}, {}]\nbits = {}\nmosaic = "
        "\"none\"\nreadout_s = 0.2\nsetting = [{{name = \"iso\", value = \"200\"}}]\n",
        camera_port_, sensor.width, sensor.height, sensor.bits);
  return fmt::format("driver = \"aravis\"\nid = \"Aravis-Fake-{}\"\nregion_px = [0, 0, {}, {}]\n",
                     kSerial, sensor.width, sensor.height);
}

std::string FakeBench::StageKeys() const {
  return fmt::format("driver = \"grbl\"\nport = \"{}\"\nv_axis = \"-y\"\norigin_m = [{}, {}]\n",
                     stage_.port(), 1e-3 * kOrigin_mm, 1e-3 * kOrigin_mm);
}

std::string FakeBench::OtherTables(bool relay) const {
  const std::string supply =
      relay ? std::string("driver = \"gpiod\"\nlamp = {line = \"lamp\"}\n")
            : fmt::format(
                  "driver = \"usbtmc\"\nvendor = {}\nproduct = {}\nvoltage_v = 12\ncurrent_a = 2\n",
                  hal::usbtmc::FakeInstrument::kVendor, kSupplyProduct);
  return fmt::format(R"([inputs]
driver = "gpiod"
emergency_stop = {{line = "e-stop", bias = "pull-up"}}
door = {{line = "door", bias = "pull-up"}}
[shutter]
driver = "gpiod"
closed = {{}}
open = {{output = {{line = "shutter"}}}}
[print]
driver = "gpiod"
plus = {{output = {{line = "plus"}}, sensor = {{line = "at-plus"}}}}
minus = {{output = {{line = "minus"}}, sensor = {{line = "at-minus"}}}}
[supply]
{}[monitor]
driver = "usbtmc"
vendor = {}
product = {}
)",
                     supply, hal::usbtmc::FakeInstrument::kVendor, kMeterProduct);
}

void FakeBench::StartCamera(const std::string& network, int seed) {
  std::array<int, 2> in{}, out{};
  ASSERT_EQ(pipe2(in.data(), O_CLOEXEC), 0);
  ASSERT_EQ(pipe2(out.data(), O_CLOEXEC), 0);
  const bool still = kind_ == CameraKind::kStill;
  const std::string program =
      e2e::BuiltProgram(still ? "fake_still_camera" : "fake_camera").string();
  camera_ = fork();
  if (camera_ == 0) {
    dup2(in[0], STDIN_FILENO);
    dup2(out[1], STDOUT_FILENO);
    unsetenv("LD_PRELOAD");
    if (!network.empty()) {
      setenv("LD_PRELOAD", e2e::BuiltProgram("bad_network.so").c_str(), 1);
      setenv("LUXFIELD_NETWORK", network.c_str(), 1);
      setenv("LUXFIELD_NETWORK_SEED", std::to_string(seed).c_str(), 1);
    }
    if (still)
      execl(program.c_str(), program.c_str(), world_.c_str(), state_file_.c_str(), nullptr);
    else
      execl(program.c_str(), program.c_str(), kSerial, world_.c_str(), state_file_.c_str(),
            nullptr);
    _exit(127);
  }
  close(in[0]);
  close(out[1]);
  camera_input_ = in[1];
  camera_port_.clear();  // aravis' says "ready"
  for (char c = 0; read(out[0], &c, 1) == 1 && c != '\n';) camera_port_ += c;
  close(out[0]);
  ASSERT_NE(camera_port_, "");
}

// The wire from the chip to the camera, which is another process.
void FakeBench::RaiseCameraInput() {
  ++pulses_;
  constexpr std::string_view kEdge = "edge\n";
  if (write(camera_input_, kEdge.data(), kEdge.size()) != static_cast<ssize_t>(kEdge.size()))
    ADD_FAILURE() << "the camera's input is not to be reached";
}

bool FakeBench::SetLink(bool up) { return UseANetworkOfOurOwn() && SetLoopback(up); }

void FakeBench::KillCamera() {
  kill(camera_, SIGKILL);
  waitpid(camera_, nullptr, 0);
  close(camera_input_);
  camera_ = 0;
}

bool FakeBench::stage_moves() {
  bool moves = false;
  stage_.Inspect([&](fakes::FakeDevice& device) {
    moves = dynamic_cast<fakes::GrblMachine&>(device).motion().speed() > 0;
  });
  return moves;
}

void FakeBench::SwitchLamp(bool on) {
  state_->lamp_on_since_s = on ? fakes::SteadySeconds() : fakes::BenchState::kOff;
}

std::string FakeBench::AnswerSupply(const std::string& message) {
  const bool before = supply_model_.on();
  std::string answer = supply_model_.Answer(message);
  if (supply_model_.on() != before) SwitchLamp(supply_model_.on());
  return answer;
}

std::string FakeBench::AnswerMeter(const std::string& message) {
  if (message.starts_with("*IDN?")) return "ACME,LightMeter,7,1.0\n";
  if (message.starts_with("READ?")) {
    const double since_s = state_->lamp_on_since_s;
    return fmt::format("{:+.6E}\n",
                       since_s == fakes::BenchState::kOff
                           ? 0.0
                           : lamp_time_.MeanFactor(fakes::SteadySeconds() - since_s, 0));
  }
  return {};
}

}  // namespace luxfield::bench
