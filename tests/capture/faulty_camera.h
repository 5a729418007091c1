// A camera for tests of what a capture does about wrong frames.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "luxfield/hal/camera.h"

namespace luxfield::capture {

// A camera that misbehaves on chosen exposures.
class FaultyCamera : public hal::Camera {
 public:
  using Mischief = std::function<void(int exposure, hal::Frame& frame, const hal::Frame& previous)>;
  FaultyCamera(std::unique_ptr<hal::Camera> camera, Mischief mischief)
      : camera_(std::move(camera)), mischief_(std::move(mischief)) {}
  std::string identity() const override { return "faulty camera"; }
  std::string firmware() const override { return version; }
  hal::CameraCapabilities capabilities() const override { return camera_->capabilities(); }
  hal::AppliedSettings Configure(const hal::CameraSettings& settings, double deadline_s) override {
    auto applied = camera_->Configure(settings, deadline_s);
    applied.exposure_s += refuse;
    return applied;
  }
  hal::Frame Expose(double deadline_s) override {
    hal::Frame frame = camera_->Expose(deadline_s);
    const hal::Frame true_frame = frame;
    mischief_(exposures_++, frame, previous_);
    previous_ = true_frame;
    return frame;
  }
  void Abort() override { camera_->Abort(); }
  double refuse = 0;
  std::string version;

 private:
  std::unique_ptr<hal::Camera> camera_;
  Mischief mischief_;
  hal::Frame previous_;
  int exposures_ = 0;
};

}  // namespace luxfield::capture
