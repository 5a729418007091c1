// Lights a scene beside the window: the newest request counts.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "luxfield/scene/scene.h"
#include "luxfield/view/lighting/failure.h"
#include "luxfield/view/lighting/lit_view.h"

namespace luxfield::view {

class LightingThread {
 public:
  struct Options {
    std::function<scene::Scene()> load;  // called on the thread
    std::string device;                  // as render::Device::Open takes it
    int threads = 0;
    std::function<void()> wake;  // called on the thread when there is news
  };
  // Begins to load at once. Nothing is lit before the first Ask.
  explicit LightingThread(Options options);
  ~LightingThread();  // waits for what cannot be interrupted
  LightingThread(const LightingThread&) = delete;
  LightingThread& operator=(const LightingThread&) = delete;

  // The scene that was loaded; null before.
  std::shared_ptr<const scene::Scene> scene() const;
  // Of the device's name and what was lit with; empty before the scene is loaded.
  std::string device_name() const;
  lightfield::FluxUnit unit() const;

  // A request of another scene is lit once that is read into the device; where it cannot be, the one
  // before stays, and TakeRefusal() says why.
  void Ask(const LitRequest& request);
  // That pictures at rest are to tell what guides their samples; nothing is lit anew for it.
  void WantFeedback(bool wanted);
  // Why a request's scene is not lit; once.
  std::optional<Failure> TakeRefusal();
  // The newest picture since the last call; of an older request than the newest only if it is quick.
  // The last one comes again when the error of soft maps or feedback is measured.
  std::optional<LitPicture> Take();
  // Why there will be no more pictures; empty: there will.
  std::optional<Failure> failure() const;
  // Warnings of the scene's reader and the renderer, one after the other.
  std::vector<std::string> messages() const;

 private:
  void Run();
  void Light(const render::Device& device, std::unique_ptr<LitView> view);
  // Makes `view` anew where the request has another scene; false where that is refused.
  bool ShowScene(const LitRequest& request, const render::Device& device,
                 std::unique_ptr<LitView>& view);
  // A round more; behind the first one, what is not known of quick pictures. Publishes it, unless
  // something else is asked for meanwhile.
  void Improve(LitView& view, LitPicture& refined);
  static bool LacksFeedback(const LitPicture& refined);
  bool Outdated() const;
  void Publish(LitPicture picture);

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable asked_;
  std::optional<LitRequest> request_;  // not yet begun
  bool stop_ = false, wants_feedback_ = false;
  std::shared_ptr<const scene::Scene> scene_;  // that was loaded
  std::shared_ptr<const scene::Scene> lit_;    // that is lit, of the thread alone
  std::string device_name_;
  std::optional<Failure> failure_, refusal_;
  lightfield::FluxUnit unit_ = lightfield::FluxUnit::kRelative;
  std::optional<LitPicture> picture_;
  std::vector<std::string> messages_;
  std::thread thread_;  // last: it uses what stands above
};

}  // namespace luxfield::view
