#include "luxfield/view/lighting/lighting_thread.h"

#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/execution.h"

namespace luxfield::view {

LightingThread::LightingThread(Options options)
    : options_(std::move(options)), thread_([this] { Run(); }) {}

LightingThread::~LightingThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  asked_.notify_all();
  thread_.join();
}

std::shared_ptr<const scene::Scene> LightingThread::scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

std::string LightingThread::device_name() const {
  const std::lock_guard lock(mutex_);
  return device_name_;
}

lightfield::FluxUnit LightingThread::unit() const {
  const std::lock_guard lock(mutex_);
  return unit_;
}

void LightingThread::Ask(const LitRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    request_ = request;
  }
  asked_.notify_all();
}

void LightingThread::WantFeedback(bool wanted) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(wants_feedback_, wanted) == wanted) return;
  }
  asked_.notify_all();
}

std::optional<LitPicture> LightingThread::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(picture_, {});
}

std::optional<Failure> LightingThread::TakeRefusal() {
  const std::lock_guard lock(mutex_);
  return std::exchange(refusal_, {});
}

std::optional<Failure> LightingThread::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

std::vector<std::string> LightingThread::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

bool LightingThread::Outdated() const {
  const std::lock_guard lock(mutex_);
  return stop_ || request_.has_value();
}

void LightingThread::Publish(LitPicture picture) {
  picture.scene = lit_;
  {
    const std::lock_guard lock(mutex_);
    picture_ = std::move(picture);
  }
  options_.wake();
}

// Quick pictures are finished even if they are outdated, so that something is seen to move; passes
// end as soon as something is asked for.
void LightingThread::Light(const render::Device& device, std::unique_ptr<LitView> view) {
  LitPicture refined;
  for (bool idle = true;;) {
    std::optional<LitRequest> next;
    {
      std::unique_lock lock(mutex_);
      asked_.wait(lock, [&] {
        return stop_ || request_ || !idle || (LacksFeedback(refined) && wants_feedback_);
      });
      if (stop_) return;
      next = std::exchange(request_, {});
    }
    if (next) {
      if (!ShowScene(*next, device, view)) {
        idle = true;
        continue;
      }
      view->Ask(*next);
      Publish(view->Quick());
      refined = {};
    } else {
      Improve(*view, refined);
    }
    idle = refined.done && !view->HasUnknownShadows();
  }
}

// The view before is kept until the new one has shown that it can light.
bool LightingThread::ShowScene(const LitRequest& request, const render::Device& device,
                               std::unique_ptr<LitView>& view) {
  if (!request.scene || request.scene == lit_) return true;
  try {
    auto other = std::make_unique<LitView>(device, *request.scene);
    other->Ask(request);
    other->Quick();
    view = std::move(other);
    lit_ = request.scene;
    return true;
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception&) {
    {
      const std::lock_guard lock(mutex_);
      refusal_ = CurrentFailure();
    }
    options_.wake();
    return false;
  }
}

bool LightingThread::LacksFeedback(const LitPicture& refined) {
  return refined.frame && !refined.feedback;
}

void LightingThread::Improve(LitView& view, LitPicture& refined) {
  const bool wants_feedback = [&] {
    const std::lock_guard lock(mutex_);
    return wants_feedback_ && LacksFeedback(refined);
  }();
  core::Execution execution;
  execution.interrupts = [this] { return Outdated() ? 1 : 0; };
  execution.threads = options_.threads;
  core::RunWith(std::move(execution), [&] {
    try {
      if (wants_feedback) {
        view.MeasureFeedback();
        refined.feedback = view.feedback();
      } else if (refined.frame && view.HasUnknownShadows()) {
        view.MeasureShadows();
        refined.soft_maps_error = view.soft_maps_error();
      } else {
        refined = view.Refine();
      }
      Publish(refined);
    } catch (const Interrupted&) {
    }
  });
}

void LightingThread::Run() {
  core::Execution execution;
  execution.message = [this](core::Severity, const std::string& text) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(text);
  };
  execution.interrupts = [this] {
    const std::lock_guard lock(mutex_);
    return stop_ ? 1 : 0;
  };
  execution.threads = options_.threads;
  core::RunWith(std::move(execution), [this] {
    try {
      lit_ = std::make_shared<const scene::Scene>(options_.load());
      const render::Device device = render::Device::Open(options_.device, options_.threads);
      auto view = std::make_unique<LitView>(device, *lit_);
      {
        const std::lock_guard lock(mutex_);
        scene_ = lit_;
        device_name_ = device.info().name;
        unit_ = view->scene().unit();
      }
      options_.wake();
      Light(device, std::move(view));
    } catch (const std::exception&) {
      const Failure failure = CurrentFailure();
      const std::lock_guard lock(mutex_);
      if (!stop_) failure_ = failure;
    }
    options_.wake();
  });
}

}  // namespace luxfield::view
