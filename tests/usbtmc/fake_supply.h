// What a SCPI supply answers, behind a FakeInstrument.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

namespace luxfield::hal::scpi {

// A supply of 0 to 30 V that knows what it is told, and measures it when it was asked whether it
// has settled.
class FakeSupply {
 public:
  std::string Answer(const std::string& message) {
    const std::string line = message.substr(0, message.find('\n'));
    if (line == "*IDN?") return "ACME,PS30,1,2.0\n";
    if (line == "*CLS") return error_.clear(), "";
    if (line == "SYST:ERR?")
      return error_.empty() ? "+0,\"No error\"\n" : std::exchange(error_, "") + "\n";
    if (line == "*OPC?") return settled_ = true, "1\n";
    if (line == "VOLT?") return fmt::format("{:+.6E}\n", volt_);
    if (line == "CURR?") return fmt::format("{:+.6E}\n", current_);
    if (line == "OUTP?") return on_ ? "1\n" : "0\n";
    if (line == "MEAS:VOLT?") return fmt::format("{:+.6E}\n", Share() * volt_);
    if (line == "MEAS:CURR?") return fmt::format("{:+.6E}\n", Share() * 0.5 * current_);
    if (line == "READ?") return "9.90000000E+37\n";
    if (line == "OUTP ON" || line == "OUTP OFF") {
      settled_ = false;
      return on_ = line.ends_with("ON"), "";
    }
    if (line.starts_with("VOLT ")) {
      const double value = std::stod(line.substr(5));
      if (value > 30)
        error_ = "-222,\"Data out of range\"";
      else
        volt_ = value;
      return "";
    }
    if (line.starts_with("CURR ")) return current_ = std::stod(line.substr(5)), "";
    error_ = "-113,\"Undefined header\"";
    return "";
  }
  bool on() const { return on_; }

 private:
  double Share() const { return !on_ ? 0 : settled_ ? 1 : 0.25; }

  double volt_ = 0, current_ = 0;
  bool on_ = false, settled_ = true;
  std::string error_ = "-410,\"Query INTERRUPTED\"";  // of who used it before
};

}  // namespace luxfield::hal::scpi
