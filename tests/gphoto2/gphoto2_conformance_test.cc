// libgphoto2 and still cameras on PTP/IP and USB through the conformance suite.
#include "tests/conformance/device_bench.h"
#include "tests/gphoto2/ptp_bench.h"
#include "tests/gphoto2/ptp_usb_host.h"

namespace luxfield::hal {
namespace {

class NetworkBench : public DeviceBench<Camera> {
 public:
  Camera& device() override { return camera_; }
  core::Clock& clock() override { return *clock_; }
  bool Mute(bool mute) override {
    bench_.host.Mute(mute);
    return true;
  }

 private:
  gphoto2::PtpBench bench_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  gphoto2::Gphoto2Camera camera_{bench_.Options(), clock_};
};

class UsbBench : public DeviceBench<Camera> {
 public:
  UsbBench() {
    gphoto2::Gphoto2Options options = bench_.Options();
    options.port.clear();  // the only one
    camera_.emplace(options, clock_);
  }
  ~UsbBench() override {
    camera_.reset();
    g_object_unref(testbed_);
  }
  Camera& device() override { return *camera_; }
  core::Clock& clock() override { return *clock_; }

 private:
  gphoto2::PtpBench bench_;
  UMockdevTestbed* testbed_ = umockdev_testbed_new();
  gphoto2::PtpUsbHost host_{testbed_, 5, bench_.camera};
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  std::optional<gphoto2::Gphoto2Camera> camera_;
};

INSTANTIATE_TEST_SUITE_P(
    Gphoto2, CameraConformance,
    testing::Values(CameraDriver{"network", [] { return std::make_unique<NetworkBench>(); }},
                    CameraDriver{"usb", [] { return std::make_unique<UsbBench>(); }}),
    NameOfDevice);

}  // namespace
}  // namespace luxfield::hal
