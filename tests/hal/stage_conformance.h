// What every driver of hal::Stage has to pass: instantiate it over a bench with that driver
// (docs/adding-a-driver.md).
//
//   INSTANTIATE_TEST_SUITE_P(Mine, StageConformance,
//                            testing::Values(StageDriver{"mine", OpenMine}), NameOfDriver);
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "luxfield/core/clock.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/stage.h"

namespace luxfield::hal {

// A stage, not yet homed, and what can be done to it behind its driver's back. A bench that cannot
// do one of these says so by returning false, and the tests that need it are skipped.
class StageBench {
 public:
  virtual ~StageBench() = default;
  virtual Stage& stage() = 0;
  virtual core::Clock& clock() = 0;  // of the deadlines
  // The device takes and says nothing (true), or goes on (false).
  virtual bool Freeze(bool /*frozen*/) { return false; }
  virtual bool Restart() { return false; }         // it loses power and comes back
  virtual bool HitLimitSwitch() { return false; }  // whatever it is doing
  // Whether the device itself moves, known sooner than by its driver's reports.
  virtual bool InMotion() { return stage().Where().moving; }
  // Whether a move takes real time, so that another thread can break it off.
  virtual bool moves_in_real_time() const { return true; }
};

struct StageDriver {
  std::string name;
  std::function<std::unique_ptr<StageBench>()> open;
};

inline std::string NameOfDriver(const testing::TestParamInfo<StageDriver>& info) {
  return info.param.name;
}

class StageConformance : public testing::TestWithParam<StageDriver> {
 protected:
  void SetUp() override { bench_ = GetParam().open(); }

  Stage& stage() { return bench_->stage(); }
  double In(double seconds) { return bench_->clock().MonotonicSeconds() + seconds; }
  // A point of the limits' rectangle, from (0, 0) to (1, 1).
  Vec2 At(double u, double v);
  void ExpectAt(Vec2 target);
  // The fault that `action` ends in; nothing if it succeeds.
  std::optional<HardwareError> ErrorOf(const std::function<void()>& action);
  std::thread MoveAcross(std::optional<HardwareError>& error);
  // Homes where the position is lost, and then moves.
  void ExpectUsableAgain();

  std::unique_ptr<StageBench> bench_;
};

}  // namespace luxfield::hal
