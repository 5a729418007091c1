// A GPIO chip of the kernel's simulator (gpio-sim), for the tests that run as root in the virtual
// machine of tests/vm/boot.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::vm {

class GpioSim {
 public:
  explicit GpioSim(std::vector<std::string> names);
  ~GpioSim();
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  const std::string& chip() const { return chip_; }  // "gpiochip0"
  void SetPin(const std::string& line, bool high);
  bool Pin(const std::string& line) const;
  // The adapter is pulled out of the machine.
  void Unplug();

 private:
  std::filesystem::path Attribute(const std::string& line, const char* name) const;

  std::vector<std::string> names_;
  std::filesystem::path config_, pins_;
  std::string chip_;
  bool live_ = false;
};

}  // namespace luxfield::vm
