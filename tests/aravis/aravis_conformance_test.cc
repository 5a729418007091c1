// aravis' own GigE Vision camera through the conformance suite.
#include <arv.h>

#include <stdexcept>

#include "luxfield/hal/drivers/aravis/aravis_camera.h"
#include "tests/aravis/camera_answers.h"
#include "tests/conformance/device_bench.h"
#include "tests/fakes/line_input.h"

namespace luxfield::hal {
namespace {

class Wire : public Trigger {
 public:
  explicit Wire(ArvFakeCamera* camera) : camera_(camera) {}
  std::string identity() const override { return "wire"; }
  void Pulse(double) override { fakes::RaiseLine0(camera_); }

 private:
  ArvFakeCamera* camera_;
};

enum class TriggeredBy { kSoftware, kLine };

class AravisBench : public DeviceBench<Camera> {
 public:
  explicit AravisBench(TriggeredBy by) : server_(arv_gv_fake_camera_new("127.0.0.1", "LUX2")) {
    if (!server_ || !arv_gv_fake_camera_is_running(server_))
      throw std::runtime_error("no camera on 127.0.0.1");
    aravis::AravisOptions options;
    options.id = "Aravis-Fake-LUX2";
    options.region = aravis::Region{0, 0, 96, 64};
    if (by == TriggeredBy::kLine) options.line_trigger = aravis::LineTrigger{"Line0"};
    camera_.emplace(options, clock_,
                    std::make_shared<Wire>(arv_gv_fake_camera_get_fake_camera(server_)));
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

INSTANTIATE_TEST_SUITE_P(
    Aravis, CameraConformance,
    testing::Values(CameraDriver{"aravis",
                                 [] {
                                   return std::make_unique<AravisBench>(TriggeredBy::kSoftware);
                                 }},
                    CameraDriver{"aravisByLine",
                                 [] { return std::make_unique<AravisBench>(TriggeredBy::kLine); }}),
    NameOfDevice);

}  // namespace
}  // namespace luxfield::hal
