// The simulated devices through the conformance suites.
#include "tests/conformance/device_bench.h"
#include "tests/hal/test_lab.h"

namespace luxfield::hal {
namespace {

template <typename Device>
class SimulatedBench : public DeviceBench<Device> {
 public:
  explicit SimulatedBench(std::unique_ptr<Device> Devices::*role, const sim::TestLab& lab = {})
      : devices_(sim::SimulatedLab(lab.Config()).MakeDevices()), role_(role) {}

  Device& device() override { return *(devices_.*role_); }
  core::Clock& clock() override { return *devices_.clock; }
  bool in_real_time() const override { return false; }
  std::optional<bool> Lit() override {
    return devices_.monitor->Read(devices_.clock->MonotonicSeconds() + 1).value > 0;
  }

 private:
  Devices devices_;
  std::unique_ptr<Device> Devices::*role_;
};

template <typename Device>
std::function<std::unique_ptr<DeviceBench<Device>>()> Simulated(
    std::unique_ptr<Device> Devices::*role, const sim::TestLab& lab = {}) {
  return [role, lab] { return std::make_unique<SimulatedBench<Device>>(role, lab); };
}

sim::TestLab WithAdc() {
  sim::TestLab lab;
  lab.lab = "";
  return lab;
}

sim::TestLab Dual() {
  sim::TestLab lab;
  lab.filter = "kind = \"dual\"\nbasis = \"quadratic\"\nspacing_m = 0.02";
  return lab;
}

INSTANTIATE_TEST_SUITE_P(Simulated, CameraConformance,
                         testing::Values(CameraDriver{"ideal", Simulated(&Devices::camera)},
                                         CameraDriver{"with_adc",
                                                      Simulated(&Devices::camera, WithAdc())}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Simulated, SelectorConformance,
                         testing::Values(SelectorDriver{"shutter", Simulated(&Devices::shutter)},
                                         SelectorDriver{"print",
                                                        Simulated(&Devices::print, Dual())}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Simulated, SupplyConformance,
                         testing::Values(SupplyDriver{"simulated", Simulated(&Devices::supply)}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Simulated, MeterConformance,
                         testing::Values(MeterDriver{"simulated", Simulated(&Devices::monitor)}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Simulated, InputsConformance,
                         testing::Values(InputsDriver{"simulated", Simulated(&Devices::inputs)}),
                         NameOfDevice);

}  // namespace
}  // namespace luxfield::hal
