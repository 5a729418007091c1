// Two Zaber linear stages on one serial line, devices 1 and 2 with one axis each: a test tool after
// the ASCII protocol's manual, checked against the conversations that the maker's own library
// records in its tests (tests/hal/zaber_test.cc).
//
// Modelled: home, move abs, stop, get and set of pos, maxspeed, limit.min, limit.max and deviceid,
// warnings clear, message ids, checksums, rejections, and the flags WR, NI and FX.
#pragma once

#include <array>

#include "tests/fakes/fake_device.h"

namespace luxfield::fakes {

class ZaberChain : public FakeDevice {
 public:
  // With `checksums` every reply carries one; those of commands are checked anyway.
  explicit ZaberChain(bool checksums = false) : checksums_(checksums) { Suffer("power cycle"); }

  void Receive(std::string_view bytes) override;
  void Advance(double seconds) override;
  std::string Transmit() override;
  bool active() const override;
  // "power cycle"; "limit switch": an axis meets a limit that it did not expect.
  bool Suffer(std::string_view event) override;

  static constexpr double kMicrosteps = 4e6;  // of travel
  static constexpr double kTopSpeed = 8e6;    // of maxspeed's unit, 1/1.6384 microsteps per second
  double position(int k) const { return axes_[k].carriage; }

 private:
  struct Axis {
    double carriage = 1.1e6;  // from the reference sensor
    double offset = 0;        // count = carriage + offset; 0 once homed
    double target = 0;        // of the carriage
    double maxspeed = 1e6;
    bool moving = false, homing = false, referenced = false, interrupted = false, tripped = false;
  };

  void Execute(std::string_view line);
  // The data of an accepted command; what starts with '!' is the reason of a rejection.
  std::string Obey(Axis& axis, int device, std::string_view text);
  void Start(Axis& axis, double target, bool homing);

  bool checksums_;
  std::array<Axis, 2> axes_;
  std::string input_, out_;
};

}  // namespace luxfield::fakes
