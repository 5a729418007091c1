#include "tests/fakes/grbl_motion.h"

#include <algorithm>
#include <cmath>

namespace luxfield::fakes {

void GrblMotion::Shift(int axis, double distance) {
  position_[axis] += distance;
  carriage_[axis] += distance;
}

void GrblMotion::Kill() {
  blocks_.clear();
  speed_ = 0;
}

bool GrblMotion::Step(double seconds, double acceleration, bool holding) {
  if (blocks_.empty()) return false;
  const Block& block = blocks_.front();
  Axes way;
  double left = 0;
  for (int k = 0; k < 3; ++k) {
    way[k] = block.target[k] - position_[k];
    left += way[k] * way[k];
  }
  left = std::sqrt(left);
  // The speed from which the rest of the way is enough to brake.
  const double braking = std::sqrt(2 * acceleration * left);
  const double wanted = holding ? 0 : std::min(block.rate, braking);
  const double change = acceleration * seconds;
  speed_ = std::clamp(wanted, speed_ - change, speed_ + change);
  const double step = speed_ * seconds;
  // Grbl counts steps; within a nanometre, or faster than braking allows, is there.
  if (step >= left || left < 1e-6) {
    for (int k = 0; k < 3; ++k) Shift(k, way[k]);
    position_ = block.target;
    blocks_.pop_front();
    speed_ = 0;
    return !blocks_.empty();
  }
  for (int k = 0; k < 3; ++k) Shift(k, way[k] * step / left);
  return speed_ > 0 || !holding;
}

}  // namespace luxfield::fakes
