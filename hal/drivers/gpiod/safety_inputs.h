// Emergency stop, door and limit switches on GPIO lines.
//
// Contacts are normally closed: an open one, or a broken wire, is active. Wire them so that an open
// contact lets the pin go to its pull-up (pin high, the default) or pull-down (`active_low`).
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "luxfield/hal/drivers/gpiod/debounce.h"
#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/instruments.h"

namespace luxfield::hal::gpiod {

struct SafetyInputsOptions {
  std::string chip;
  std::optional<LineSettings> emergency_stop, door, limit;  // one at least
  double assert_s = 0.002;                                  // debounce.h
  double release_s = 0.05;
};

// A thread waits for edges and reads the levels, at least ten times a second even without an edge.
// It asks for real-time priority and goes on without where the system refuses. Where the lines
// cannot be read any more the state stays unsafe until the object is made anew.
class SafetyInputs : public Inputs {
 public:
  explicit SafetyInputs(SafetyInputsOptions options);
  ~SafetyInputs() override;

  std::string identity() const override;
  InputState State() override;
  void OnTrip(Action action) override;
  bool real_time() const override { return real_time_; }

 private:
  enum class Contact { kEmergencyStop, kDoor, kLimit };

  void Watch();
  // Waits for an edge, the next debounced change or the next look; false when asked to end.
  bool Wait() const;
  void Look();
  void Publish(const InputState& state);

  SafetyInputsOptions options_;
  std::vector<Contact> contacts_;  // of the lines
  std::optional<InputLines> lines_;
  std::vector<Debounce> debounced_;
  int end_fd_ = -1;
  bool real_time_ = false;

  std::mutex mutex_;  // of what follows
  InputState state_;
  std::mutex action_mutex_;  // held while an action runs, taken before mutex_
  Action action_;
  std::thread thread_;
};

}  // namespace luxfield::hal::gpiod
