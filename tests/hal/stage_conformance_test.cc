// Every stage driver there is, through the conformance suite.
#include "tests/hal/stage_conformance.h"

#include <map>

#include "luxfield/hal/drivers/grbl/grbl_stage.h"
#include "luxfield/hal/drivers/zaber/zaber_stage.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/transport/open_port.h"
#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"
#include "tests/fakes/zaber_chain.h"
#include "tests/hal/test_lab.h"

namespace luxfield::hal {
namespace {

class SimulatedBench : public StageBench {
 public:
  Stage& stage() override { return *devices_.stage; }
  core::Clock& clock() override { return *devices_.clock; }
  bool moves_in_real_time() const override { return false; }

 private:
  Devices devices_ = sim::SimulatedLab(sim::TestLab{}.Config()).MakeDevices();
};

// A driver over a pseudo terminal with a fake device behind it.
class FakeBench : public StageBench {
 public:
  Stage& stage() override { return *stage_; }
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

 protected:
  FakeBench(std::unique_ptr<fakes::FakeDevice> device, double speed_up)
      : host_(std::move(device), speed_up) {}

  fakes::PtyHost host_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  std::unique_ptr<Stage> stage_;
};

constexpr StageLimits kLimits{{-0.08, -0.06}, {0.08, 0.06}, 0.1, 0.01, 0};

class GrblBench : public FakeBench {
 public:
  explicit GrblBench(const std::map<int, double>& more = {})
      : FakeBench(std::make_unique<fakes::GrblMachine>(Settings(more)), 3) {
    grbl::StageSetup setup;
    setup.limits = kLimits;
    setup.axes = {grbl::Axis{0, 1, -100}, grbl::Axis{1, -1, -100}};
    stage_ = std::make_unique<grbl::GrblStage>(OpenPort(host_.port(), 115200, SecondsFromNow(1)),
                                               setup, clock_);
  }

 private:
  // A quick machine: the conversations count here, not the waits.
  static std::map<int, double> Settings(const std::map<int, double>& more) {
    std::map<int, double> settings = {{110, 6000}, {111, 6000}, {120, 2000}, {121, 2000},
                                      {24, 3000},  {25, 60000}, {26, 5}};
    for (const auto& [number, value] : more) settings[number] = value;
    return settings;
  }
};

class ZaberBench : public FakeBench {
 public:
  ZaberBench() : FakeBench(std::make_unique<fakes::ZaberChain>(true), 3) {
    zaber::StageSetup setup;
    setup.limits = kLimits;
    setup.axes = {zaber::Axis{1, 1, 1, 0.1, 5e-8}, zaber::Axis{2, 1, -1, 0.1, 5e-8}};
    stage_ = std::make_unique<zaber::ZaberStage>(OpenPort(host_.port(), 115200, SecondsFromNow(1)),
                                                 setup, clock_);
  }
};

INSTANTIATE_TEST_SUITE_P(
    All, StageConformance,
    testing::Values(
        StageDriver{"simulated", [] { return std::make_unique<SimulatedBench>(); }},
        StageDriver{"grbl", [] { return std::make_unique<GrblBench>(); }},
        StageDriver{"grbl_homing_low_reporting_work_positions",
                    [] {
                      return std::make_unique<GrblBench>(std::map<int, double>{{23, 3}, {10, 0}});
                    }},
        StageDriver{"zaber", [] { return std::make_unique<ZaberBench>(); }}),
    NameOfDriver);

}  // namespace
}  // namespace luxfield::hal
