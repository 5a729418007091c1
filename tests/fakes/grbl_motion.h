// The planner and steppers of the fake Grbl controller, and the carriage they move.
#pragma once

#include <array>
#include <deque>

namespace luxfield::fakes {

using Axes = std::array<double, 3>;  // mm

// Straight moves one after the other, each from rest to rest with constant acceleration: slower at
// junctions than Grbl's look-ahead, the same at every end.
class GrblMotion {
 public:
  static constexpr std::size_t kBlocks = 15;  // that can wait; Grbl's ring of 16 keeps one free

  struct Block {
    Axes target;
    double rate = 0;  // mm/s along the way
  };

  void Add(const Block& block) { blocks_.push_back(block); }
  bool empty() const { return blocks_.empty(); }
  bool full() const { return blocks_.size() >= kBlocks; }
  std::size_t free_blocks() const { return kBlocks - blocks_.size(); }
  // Where the last planned move ends.
  Axes End() const { return blocks_.empty() ? position_ : blocks_.back().target; }

  // Moves for `seconds`, braking to rest while `holding`. True while it moves.
  bool Step(double seconds, double acceleration, bool holding);
  // Stops dead and forgets all moves, as a reset does.
  void Kill();

  const Axes& position() const { return position_; }
  double speed() const { return speed_; }
  // Sets what the controller believes; the carriage stays where it is.
  void SetPosition(const Axes& position) { position_ = position; }
  // Moves controller's count and carriage together, outside the planner (homing).
  void Shift(int axis, double distance);

  // The carriage in the frame of the switches, which the controller only knows after homing.
  const Axes& carriage() const { return carriage_; }
  void PutCarriage(const Axes& carriage) { carriage_ = carriage; }

 private:
  std::deque<Block> blocks_;
  Axes position_{}, carriage_{};
  double speed_ = 0;
};

}  // namespace luxfield::fakes
