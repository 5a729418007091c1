// The smaller devices of a rig.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace luxfield::hal {

// One of several named positions: colour filter wheel, print changer, shutter, lamp relay.
class Selector {
 public:
  virtual ~Selector() = default;
  virtual std::string identity() const = 0;
  virtual std::vector<std::string> positions() const = 0;
  // Returns when the position is reached and read back. kOutOfRange for names it does not have.
  virtual void Select(const std::string& position, double deadline_s) = 0;
  virtual std::string Current() = 0;
};

struct Reading {
  double value = 0;
  std::string unit;
  bool over_range = false;
  double t_s = 0;  // rig clock, middle of the measurement
};

// Luxmeter, power meter, monitor diode, thermometer.
class Meter {
 public:
  virtual ~Meter() = default;
  virtual std::string identity() const = 0;
  virtual Reading Read(double deadline_s) = 0;
};

struct SupplyState {
  double voltage_v = 0, current_a = 0;  // NaN: not measured
  bool output = false;
};

// The lamp's power supply.
class Supply {
 public:
  virtual ~Supply() = default;
  virtual std::string identity() const = 0;
  virtual SupplyState SetOutput(bool on, double deadline_s) = 0;  // reads back
  virtual SupplyState State() = 0;
};

struct InputState {
  bool emergency_stop = false;  // pressed, or its wire is broken
  bool door_open = false;
  bool limit = false;      // the stage stands on a limit switch
  std::string unreadable;  // why the inputs cannot be read; counts as an emergency stop

  bool safe() const { return !emergency_stop && !door_open && !limit && unreadable.empty(); }
};
// What is wrong, in words: "the emergency stop is active"; empty where it is safe.
std::string Describe(const InputState& state);

// Safety inputs, debounced. They are observed here; the emergency stop cuts power in hardware.
class Inputs {
 public:
  // Called from a thread of the inputs' own, and short: what it does delays what it is told of.
  using Action = std::function<void(const InputState&)>;

  virtual ~Inputs() = default;
  virtual std::string identity() const = 0;
  virtual InputState State() = 0;
  // Calls `action` once whenever the inputs turn from safe to unsafe, and at once where they are
  // unsafe now. An empty action ends it, and returns after the last call has.
  virtual void OnTrip(Action action) = 0;
  // False where other programs may keep their thread waiting.
  virtual bool real_time() const { return true; }
};

}  // namespace luxfield::hal
