// SCPI supply and meter over USBTMC through the conformance suites.
#include "luxfield/hal/drivers/scpi/scpi.h"
#include "luxfield/hal/drivers/usbtmc/usbtmc.h"
#include "tests/conformance/device_bench.h"
#include "tests/usbtmc/fake_instrument.h"
#include "tests/usbtmc/fake_supply.h"

namespace luxfield::hal {
namespace {

constexpr double kOpen_s = 5;

template <typename Device>
class UsbBench : public DeviceBench<Device> {
 public:
  core::Clock& clock() override { return *clock_; }
  Device& device() override { return *device_; }
  bool Mute(bool mute) override {
    instrument_.Set({.mute = mute});
    return true;
  }

 protected:
  explicit UsbBench(std::function<std::string(const std::string&)> answer)
      : instrument_(std::move(answer)) {}
  std::unique_ptr<MessageChannel> Channel() {
    return std::make_unique<usbtmc::UsbTmc>(usbtmc::UsbTmcOptions{
        usbtmc::FakeInstrument::kVendor, usbtmc::FakeInstrument::kProduct, {}});
  }
  double Soon() { return clock_->MonotonicSeconds() + kOpen_s; }

  usbtmc::FakeInstrument instrument_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  std::unique_ptr<Device> device_;
};

class SupplyBench : public UsbBench<Supply> {
 public:
  SupplyBench() : UsbBench([this](const std::string& message) { return supply_.Answer(message); }) {
    device_ =
        std::make_unique<scpi::ScpiSupply>(Channel(), scpi::SupplyOptions{12, 2}, clock_, Soon());
  }
  ~SupplyBench() override { device_.reset(); }  // it switches the fake supply off
  std::optional<bool> Lit() override { return supply_.on(); }
  bool Close() override {
    device_.reset();
    return true;
  }

 private:
  scpi::FakeSupply supply_;
};

class MeterBench : public UsbBench<Meter> {
 public:
  MeterBench()
      : UsbBench([](const std::string& message) -> std::string {
          if (message == "*IDN?\n") return "ACME,LightMeter,7,1.0\n";
          return message == "READ?\n" ? "+1.25000E+02\n" : "";
        }) {
    device_ = std::make_unique<scpi::ScpiMeter>(Channel(), scpi::MeterOptions{"READ?", "lx"},
                                                clock_, Soon());
  }
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Usb, SupplyConformance,
                         testing::Values(SupplyDriver{
                             "scpi", [] { return std::make_unique<SupplyBench>(); }}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Usb, MeterConformance,
                         testing::Values(MeterDriver{
                             "scpi", [] { return std::make_unique<MeterBench>(); }}),
                         NameOfDevice);

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(SelectorConformance);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(InputsConformance);

}  // namespace luxfield::hal
