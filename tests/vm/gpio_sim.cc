#include "tests/vm/gpio_sim.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "tests/vm/attribute.h"

namespace luxfield::vm {
namespace fs = std::filesystem;

GpioSim::GpioSim(std::vector<std::string> names) : names_(std::move(names)) {
  static int number = 0;
  config_ = fmt::format("/sys/kernel/config/gpio-sim/chip{}", number++);
  const fs::path bank = config_ / "bank";
  fs::create_directories(bank);
  WriteAttribute(bank / "num_lines", std::to_string(names_.size()));
  for (std::size_t k = 0; k < names_.size(); ++k) {
    const fs::path line = bank / fmt::format("line{}", k);
    fs::create_directory(line);
    WriteAttribute(line / "name", names_[k]);
  }
  WriteAttribute(config_ / "live", "1");
  live_ = true;
  chip_ = ReadAttribute(bank / "chip_name");
  pins_ = fs::path("/sys/devices/platform") / ReadAttribute(config_ / "dev_name") / chip_;
}

GpioSim::~GpioSim() {
  try {
    if (live_) Unplug();
    for (std::size_t k = 0; k < names_.size(); ++k)
      fs::remove(config_ / "bank" / fmt::format("line{}", k));
    fs::remove(config_ / "bank");
    fs::remove(config_);
  } catch (const std::exception& error) {
    fmt::print(stderr, "the simulated chip stays: {}\n", error.what());
  }
}

void GpioSim::Unplug() {
  WriteAttribute(config_ / "live", "0");
  live_ = false;
}

fs::path GpioSim::Attribute(const std::string& line, const char* name) const {
  const auto found = std::find(names_.begin(), names_.end(), line);
  if (found == names_.end()) throw std::invalid_argument("no line " + line);
  return pins_ / fmt::format("sim_gpio{}", found - names_.begin()) / name;
}

void GpioSim::SetPin(const std::string& line, bool high) {
  WriteAttribute(Attribute(line, "pull"), high ? "pull-up" : "pull-down");
}

bool GpioSim::Pin(const std::string& line) const {
  return ReadAttribute(Attribute(line, "value")) == "1";
}

}  // namespace luxfield::vm
