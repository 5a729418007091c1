// Shutter, changer, lamp relay and safety inputs on GPIO lines through the conformance suites.
#include "luxfield/hal/drivers/gpiod/line_selector.h"
#include "luxfield/hal/drivers/gpiod/safety_inputs.h"
#include "tests/conformance/device_bench.h"
#include "tests/gpiod/fake_gpio_chip.h"

namespace luxfield::hal::gpiod {
namespace {

template <typename Device>
class GpioBench : public DeviceBench<Device> {
 public:
  core::Clock& clock() override { return *clock_; }
  Device& device() override { return *device_; }

 protected:
  FakeGpioChip chip_{{"a", "b", "at-a", "at-b", "e-stop"}};
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  std::unique_ptr<Device> device_;
};

class ShutterBench : public GpioBench<Selector> {
 public:
  ShutterBench() {
    device_ = std::make_unique<LineSelector>(
        LineSelectorOptions{
            "shutter", "gpiochip0", {{"closed", {}, {}}, {"open", LineSettings{"a"}, {}}}, 0.01},
        clock_);
  }
  bool Stick() override {
    chip_.StickPin("a");
    return true;
  }
};

class ChangerBench : public GpioBench<Selector> {
 public:
  ChangerBench() {
    chip_.Couple("a", "at-a");
    chip_.Couple("b", "at-b");
    device_ = std::make_unique<LineSelector>(
        LineSelectorOptions{"changer",
                            "gpiochip0",
                            {{"plus", LineSettings{"a"}, LineSettings{"at-a"}},
                             {"minus", LineSettings{"b"}, LineSettings{"at-b"}}},
                            0.01},
        clock_);
  }
  bool Stick() override {
    chip_.Couple("a", "e-stop");  // its sensors see nothing any more
    chip_.Couple("b", "e-stop");
    return true;
  }
};

class RelayBench : public GpioBench<Supply> {
 public:
  RelayBench() { device_ = std::make_unique<LampRelay>("gpiochip0", LineSettings{"a"}); }
  std::optional<bool> Lit() override { return chip_.Pin("a"); }
  bool Stick() override {
    chip_.StickPin("a");
    return true;
  }
  bool Close() override {
    device_.reset();
    return true;
  }
};

class ContactsBench : public GpioBench<Inputs> {
 public:
  ContactsBench() {
    SafetyInputsOptions options;
    options.chip = "gpiochip0";
    options.emergency_stop = LineSettings{"e-stop"};
    device_ = std::make_unique<SafetyInputs>(options);
  }
  bool Trip(bool unsafe) override {
    chip_.SetPin("e-stop", unsafe);
    return true;
  }
};

}  // namespace
}  // namespace luxfield::hal::gpiod

namespace luxfield::hal {

INSTANTIATE_TEST_SUITE_P(
    Gpio, SelectorConformance,
    testing::Values(
        SelectorDriver{"shutter", [] { return std::make_unique<gpiod::ShutterBench>(); }},
        SelectorDriver{"changer", [] { return std::make_unique<gpiod::ChangerBench>(); }}),
    NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Gpio, SupplyConformance,
                         testing::Values(SupplyDriver{
                             "relay", [] { return std::make_unique<gpiod::RelayBench>(); }}),
                         NameOfDevice);
INSTANTIATE_TEST_SUITE_P(Gpio, InputsConformance,
                         testing::Values(InputsDriver{
                             "contacts", [] { return std::make_unique<gpiod::ContactsBench>(); }}),
                         NameOfDevice);

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(MeterConformance);

}  // namespace luxfield::hal
