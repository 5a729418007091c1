// aravis' own GigE Vision camera through the conformance suite.
#include <arv.h>

#include <stdexcept>

#include "hal/aravis/aravis_camera.h"
#include "tests/aravis/camera_answers.h"
#include "tests/conformance/device_bench.h"

namespace luxfield::hal {
namespace {

class AravisBench : public DeviceBench<Camera> {
 public:
  AravisBench() : server_(arv_gv_fake_camera_new("127.0.0.1", "LUX2")) {
    if (!server_ || !arv_gv_fake_camera_is_running(server_))
      throw std::runtime_error("no camera on 127.0.0.1");
    aravis::AravisOptions options;
    options.id = "Aravis-Fake-LUX2";
    options.region = aravis::Region{0, 0, 96, 64};
    camera_.emplace(options, clock_);
  }
  ~AravisBench() override {
    aravis::cameras_are_mute = false;
    camera_.reset();
    g_object_unref(server_);
  }
  Camera& device() override { return *camera_; }
  core::Clock& clock() override { return *clock_; }
  bool Mute(bool mute) override {
    aravis::cameras_are_mute = mute;
    return true;
  }

 private:
  ArvGvFakeCamera* server_;
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  std::optional<aravis::AravisCamera> camera_;
};

INSTANTIATE_TEST_SUITE_P(Aravis, CameraConformance,
                         testing::Values(CameraDriver{
                             "aravis", [] { return std::make_unique<AravisBench>(); }}),
                         NameOfDevice);

}  // namespace
}  // namespace luxfield::hal
