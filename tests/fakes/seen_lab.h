// What a camera of a bench sees: the simulated lab where the bench's devices have put it.
#pragma once

#include <filesystem>

#include "luxfield/hal/sim/world.h"
#include "tests/fakes/bench_state.h"
#include "tests/fakes/exposure_log.h"

namespace luxfield::fakes {

class SeenLab {
 public:
  SeenLab(const std::filesystem::path& lab_toml, const std::filesystem::path& state);

  // Counts and logs the exposure (exposure_log.h); does not wait for its end.
  session::RawFrame Expose(double exposure_s);
  const hal::sim::LabDescription& lab() const { return lab_; }

 private:
  SeenExposure Arrange();

  hal::sim::LabDescription lab_;
  hal::sim::World world_;
  SharedBenchState state_;
  std::filesystem::path log_;
  double lamp_on_since_s_ = BenchState::kOff;
  double switched_on_s_ = 0;  // on the simulated clock
};

}  // namespace luxfield::fakes
