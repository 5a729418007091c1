// libgphoto2 and a still camera on PTP/IP through the conformance suite.
#include "tests/conformance/device_bench.h"
#include "tests/gphoto2/ptp_bench.h"

namespace luxfield::hal {
namespace {

class Gphoto2Bench : public DeviceBench<Camera> {
 public:
  Camera& device() override { return camera_; }
  core::Clock& clock() override { return *clock_; }

 private:
  gphoto2::PtpBench bench_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  gphoto2::Gphoto2Camera camera_{bench_.Options(), clock_};
};

INSTANTIATE_TEST_SUITE_P(Gphoto2, CameraConformance,
                         testing::Values(CameraDriver{
                             "gphoto2", [] { return std::make_unique<Gphoto2Bench>(); }}),
                         NameOfDevice);

}  // namespace
}  // namespace luxfield::hal
