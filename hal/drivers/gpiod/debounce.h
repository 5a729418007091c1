// The state of a contact that bounces.
//
// It becomes active when the contact has been seen active over `assert_s`, bounces back included,
// and inactive when it has been inactive without a break for `release_s`. A contact that is
// inactive again for `assert_s` before the state became active was a spike. So an emergency stop
// trips within assert_s of its first edge however it bounces, and is not released by a loose wire.
#pragma once

#include <optional>

namespace luxfield::hal::gpiod {

class Debounce {
 public:
  Debounce(double assert_s, double release_s, bool active)
      : assert_s_(assert_s), release_s_(release_s), state_(active), level_(active) {}

  bool state() const { return state_; }

  // The contact's level at a time, which never goes back; returns the state.
  bool Update(bool active, double now_s) {
    if (active != level_) since_ = now_s;
    level_ = active;
    if (active) {
      if (!state_ && !pending_) first_active_s_ = now_s;
      pending_ = !state_;
      if (pending_ && now_s >= first_active_s_ + assert_s_) {
        state_ = true;
        pending_ = false;
      }
      return state_;
    }
    if (state_ && now_s >= since_ + release_s_) state_ = false;
    if (pending_ && now_s >= since_ + assert_s_) pending_ = false;
    return state_;
  }

  // When Update will change something although the level stays; absent: never.
  std::optional<double> Next() const {
    if (pending_) return (level_ ? first_active_s_ : since_) + assert_s_;
    if (state_ && !level_) return since_ + release_s_;
    return {};
  }

 private:
  double assert_s_, release_s_;
  bool state_, level_;
  double since_ = 0;      // of the level
  bool pending_ = false;  // seen active at first_active_s_: about to become active, or a spike
  double first_active_s_ = 0;
};

}  // namespace luxfield::hal::gpiod
