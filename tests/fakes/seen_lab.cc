#include "tests/fakes/seen_lab.h"

#include "luxfield/core/config.h"
#include "luxfield/core/file.h"

namespace luxfield::fakes {

SeenLab::SeenLab(const std::filesystem::path& lab_toml, const std::filesystem::path& state)
    : lab_(hal::sim::ReadLab(core::Config::FromFile(lab_toml), {})),
      world_(lab_),
      state_(state, false),
      log_(ExposureLogOf(state)) {}

session::RawFrame SeenLab::Expose(double exposure_s) {
  SeenExposure seen = Arrange();
  seen.exposure_s = exposure_s;
  session::RawFrame frame = world_.Expose(exposure_s, ++state_->exposures);
  seen.pixels_sha256 = core::Sha256(session::PixelBytes(frame));
  AppendExposure(log_, seen);
  return frame;
}

SeenExposure SeenLab::Arrange() {
  SeenExposure seen;
  const double since_s = state_->lamp_on_since_s;
  core::SimulatedClock& clock = *world_.clock();
  if (since_s != lamp_on_since_s_) {
    world_.SwitchLamp(false);
    world_.SwitchLamp(since_s != BenchState::kOff);
    switched_on_s_ = clock.MonotonicSeconds();
    lamp_on_since_s_ = since_s;
  }
  seen.start_s = SteadySeconds();
  // The lamp's age is what its output depends on.
  if (since_s != BenchState::kOff) {
    const double age_s = seen.start_s - since_s;
    seen.lamp = lab_.lamp_time.MeanFactor(age_s, 0);
    clock.SleepSeconds(switched_on_s_ + age_s - clock.MonotonicSeconds());
  }
  seen.u_m = state_->u_m;
  seen.v_m = state_->v_m;
  world_.MoveStage({seen.u_m, seen.v_m});
  world_.shutter_open = seen.shutter_open = state_->shutter_open;
  world_.print = seen.print = state_->print;
  return seen;
}

}  // namespace luxfield::fakes
