// The smaller devices of a rig.
#pragma once

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
  double voltage_v = 0, current_a = 0;
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
};

// Safety inputs, debounced. They are observed here; the emergency stop cuts power in hardware.
class Inputs {
 public:
  virtual ~Inputs() = default;
  virtual std::string identity() const = 0;
  virtual InputState State() = 0;
};

}  // namespace luxfield::hal
