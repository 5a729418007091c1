#include "luxfield/hal/sim/followed_stage.h"

#include <chrono>
#include <functional>

#include "luxfield/hal/error.h"

namespace luxfield::hal::sim {
namespace {

class FollowedStage : public Stage {
 public:
  FollowedStage(std::unique_ptr<Stage> real, std::shared_ptr<World> world)
      : real_(std::move(real)), world_(std::move(world)) {}

  std::string identity() const override { return real_->identity(); }
  StageLimits limits() const override {
    StageLimits limits = real_->limits();
    limits.repeatability_m = world_->lab().stage.options.limits.repeatability_m;
    return limits;
  }
  void Home(double deadline_s) override {
    Move([&] { real_->Home(deadline_s); });
  }
  void MoveTo(Vec2 centre, double deadline_s) override {
    Move([&] { real_->MoveTo(centre, deadline_s); });
  }
  StagePosition Where() override { return real_->Where(); }
  void Stop() override { real_->Stop(); }

 private:
  void Move(const std::function<void()>& drive) {
    const auto start = std::chrono::steady_clock::now();
    const auto follow = [&] {
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      world_->clock()->SleepSeconds(taken.count());
      world_->MoveStage(real_->Where().readback);
    };
    try {
      drive();
    } catch (const HardwareError&) {
      try {
        follow();
      } catch (const HardwareError&) {  // it is not to be reached; the first error says why
      }
      throw;
    }
    follow();
  }

  std::unique_ptr<Stage> real_;
  std::shared_ptr<World> world_;
};

}  // namespace

std::unique_ptr<Stage> Follow(std::unique_ptr<Stage> real, std::shared_ptr<World> world) {
  return std::make_unique<FollowedStage>(std::move(real), std::move(world));
}

}  // namespace luxfield::hal::sim
