#include "tests/fakes/seen_lab.h"

#include "core/config.h"

namespace luxfield::fakes {

SeenLab::SeenLab(const std::filesystem::path& lab_toml, const std::filesystem::path& state)
    : lab_(hal::sim::ReadLab(core::Config::FromFile(lab_toml), {})),
      world_(lab_),
      state_(state, false) {}

core::RawFrame SeenLab::Expose(double exposure_s) {
  Arrange();
  return world_.Expose(exposure_s, ++state_->exposures);
}

void SeenLab::Arrange() {
  const double since_s = state_->lamp_on_since_s;
  core::SimulatedClock& clock = *world_.clock();
  if (since_s != lamp_on_since_s_) {
    world_.SwitchLamp(false);
    world_.SwitchLamp(since_s != BenchState::kOff);
    switched_on_s_ = clock.MonotonicSeconds();
    lamp_on_since_s_ = since_s;
  }
  // The lamp's age is what its output depends on.
  if (since_s != BenchState::kOff)
    clock.SleepSeconds(switched_on_s_ + SteadySeconds() - since_s - clock.MonotonicSeconds());
  world_.MoveStage({state_->u_m, state_->v_m});
  world_.shutter_open = state_->shutter_open;
  world_.print = state_->print;
}

}  // namespace luxfield::fakes
