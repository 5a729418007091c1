// A bench of fake devices for the whole program: camera, stage, contacts, shutter, print changer,
// lamp supply and light meter, which together are the lab of a simulated lab.toml.
//
// The camera is a process of its own, aravis' GigE Vision server or a still camera on PTP/IP; the
// stage is a Grbl controller
// behind a pty; GPIO chip and USB instruments are umockdev's. Programs that are started while the
// bench stands reach them all. The test program runs under umockdev-wrapper.
#pragma once

#include <sys/types.h>
#include <umockdev.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/hal/sim/lamp_time.h"
#include "tests/fakes/bench_state.h"
#include "tests/fakes/exposure_log.h"
#include "tests/fakes/pty_host.h"
#include "tests/gpiod/fake_gpio_chip.h"
#include "tests/usbtmc/fake_instrument.h"
#include "tests/usbtmc/fake_supply.h"

namespace luxfield::bench {

// What every lab.toml of the bench states, the simulated one and those of its devices.
inline constexpr const char* kRig = R"([rig]
kind = "lensless"
delta_m = 0.3
[filter]
kind = "dual"
basis = "quadratic"
spacing_m = 0.032
)";
inline constexpr const char* kCamera = R"(pitch_m = 0.008
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
responsivity_e_per_s_per_w_m2 = [24000]
)";
inline constexpr const char* kTravel = R"(min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = 0.05
)";

enum class CameraKind { kMachineVision, kStill };

class FakeBench {
 public:
  // Files of the bench go into `folder`; `world` is the simulated lab that the camera sees.
  FakeBench(const std::filesystem::path& folder, const std::filesystem::path& world,
            CameraKind camera);
  ~FakeBench();
  FakeBench(const FakeBench&) = delete;
  FakeBench& operator=(const FakeBench&) = delete;

  // The tables [camera] (its driver's keys), [stage] ... [monitor] of a lab.toml that names these
  // devices. A machine vision camera is triggered by its network, or by a line.
  std::string CameraKeys() const;
  static constexpr const char* kLineKeys = "trigger_source = \"Line0\"\n";  // more of [camera]
  static constexpr const char* kTrigger =
      "[trigger]\ndriver = \"gpiod\"\noutput = {line = \"trigger\"}\n";
  int trigger_pulses() { return pulses_; }
  std::string StageKeys() const;
  // The lamp is switched by its supply, or by a relay.
  std::string OtherTables(bool relay = false) const;

  // Behind a network that drops, delays, duplicates, truncates or garbles what it sends, hangs or
  // stalls (tests/preload/bad_network.cc); "": a good one.
  void StartCamera(const std::string& network = "", int seed = 1);
  void KillCamera();  // SIGKILL
  // Cuts and mends the camera's link, an interface that is down and up; false: it is not ours.
  bool SetLink(bool up);
  void PressEmergencyStop(bool pressed) { chip_.SetPin("e-stop", pressed); }
  void OpenDoor(bool open) { chip_.SetPin("door", open); }
  hal::usbtmc::FakeInstrument& meter() { return *meter_; }
  bool lamp_on() const { return state_->lamp_on_since_s != fakes::BenchState::kOff; }
  std::uint64_t exposures() const { return state_->exposures; }
  // What the camera saw in each of them.
  std::vector<fakes::SeenExposure> SeenExposures() const {
    return fakes::ReadExposures(fakes::ExposureLogOf(state_file_));
  }
  bool stage_moves();

 private:
  void SwitchLamp(bool on);
  void RaiseCameraInput();
  std::string AnswerSupply(const std::string& message);
  std::string AnswerMeter(const std::string& message);

  CameraKind kind_;
  std::filesystem::path world_, state_file_;
  fakes::SharedBenchState state_;
  hal::sim::LampTime lamp_time_;
  UMockdevTestbed* testbed_;
  fakes::PtyHost stage_;
  hal::gpiod::FakeGpioChip chip_;
  hal::scpi::FakeSupply supply_model_;
  std::unique_ptr<hal::usbtmc::FakeInstrument> supply_, meter_;
  std::string preload_before_;
  pid_t camera_ = 0;
  int camera_input_ = -1;
  std::atomic<int> pulses_ = 0;
  std::string camera_port_;  // what it says when it can be reached
};

}  // namespace luxfield::bench
