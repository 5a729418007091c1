#include "tests/fakes/zaber_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <utility>
#include <vector>

namespace luxfield::fakes {
namespace {

int Lrc(std::string_view text) {
  int sum = 0;
  for (const char c : text) sum += static_cast<unsigned char>(c);
  return -sum & 0xFF;
}

}  // namespace

bool ZaberChain::Suffer(std::string_view event) {
  for (Axis& axis : axes_) {
    if (event == "power cycle") {
      const double at = axis.carriage, maxspeed = axis.maxspeed;
      axis = Axis{};
      axis.carriage = at;
      axis.offset = -at;
      axis.maxspeed = maxspeed;
    } else if (event == "limit switch") {
      axis.moving = axis.homing = false;
      axis.tripped = true;
      axis.referenced = false;
    } else {
      return false;
    }
  }
  return true;
}

std::string ZaberChain::Transmit() { return std::exchange(out_, {}); }

bool ZaberChain::active() const {
  return std::any_of(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.moving; });
}

void ZaberChain::Advance(double seconds) {
  for (Axis& axis : axes_) {
    if (!axis.moving) continue;
    const double step = axis.maxspeed / 1.6384 * seconds, left = axis.target - axis.carriage;
    axis.carriage += std::clamp(left, -step, step);
    if (std::abs(left) > step) continue;
    axis.moving = false;
    if (std::exchange(axis.homing, false)) {
      axis.offset = 0;
      axis.referenced = true;
    }
  }
}

// Everything before a slash is ignored; a command ends at the line's end.
void ZaberChain::Receive(std::string_view bytes) {
  for (const char c : bytes) {
    if (c == '/') input_.clear();
    if (c != '\n' && c != '\r') {
      if (input_.size() < 80) input_ += c;
      continue;
    }
    if (input_.starts_with('/')) Execute(std::string_view(input_).substr(1));
    input_.clear();
  }
}

void ZaberChain::Execute(std::string_view line) {
  if (const auto colon = line.rfind(':'); colon != std::string_view::npos) {
    const std::string stated(line.substr(colon + 1));
    line = line.substr(0, colon);
    if (std::strtol(stated.c_str(), nullptr, 16) != Lrc(line)) return;  // ignored, says the manual
  }
  // Up to three numbers: device, axis, id.
  std::istringstream words{std::string(line)};
  std::vector<int> numbers;
  std::string text, word;
  while (words >> word)
    if (text.empty() && numbers.size() < 3 && std::isdigit(static_cast<unsigned char>(word[0])))
      numbers.push_back(std::atoi(word.c_str()));
    else
      text += (text.empty() ? "" : " ") + word;
  numbers.resize(3, -1);
  const int address = std::max(numbers[0], 0), axis_number = std::max(numbers[1], 0);
  for (int device = 1; device <= 2; ++device) {
    if (address != 0 && address != device) continue;
    Axis& axis = axes_[device - 1];
    std::string data = axis_number > 1 ? "!BADAXIS" : Obey(axis, device, text);
    const bool accepted = !data.starts_with('!');
    if (!accepted) data.erase(0, 1);
    const char* warning = axis.tripped       ? "FX"
                          : !axis.referenced ? "WR"
                          : axis.interrupted ? "NI"
                                             : "--";
    if (text == "warnings clear") axis.tripped = axis.interrupted = false;
    std::string reply = fmt::format("{:02} {}", device, axis_number);
    if (numbers[2] >= 0) reply += fmt::format(" {:02}", numbers[2]);
    reply += fmt::format(" {} {} {} {}", accepted ? "OK" : "RJ", axis.moving ? "BUSY" : "IDLE",
                         warning, data);
    if (checksums_) reply += fmt::format(":{:02X}", Lrc(reply));
    out_ += "@" + reply + "\r\n";
  }
}

void ZaberChain::Start(Axis& axis, double target, bool homing) {
  axis.target = target;
  axis.moving = true;
  axis.homing = homing;
  axis.interrupted = false;
}

std::string ZaberChain::Obey(Axis& axis, int device, std::string_view text) {
  const auto number_after = [&](std::string_view prefix) {
    return std::atof(std::string(text.substr(prefix.size())).c_str());
  };
  if (text.empty() || text == "warnings clear") return "0";
  if (text == "home") {
    Start(axis, 0, true);
    return "0";
  }
  if (text == "stop") {
    axis.interrupted = axis.interrupted || axis.moving;
    axis.moving = axis.homing = false;
    return "0";
  }
  if (text == "get pos") return fmt::format("{:.0f}", std::round(axis.carriage + axis.offset));
  if (text == "get limit.min") return "0";
  if (text == "get limit.max") return fmt::format("{:.0f}", kMicrosteps);
  if (text == "get maxspeed") return fmt::format("{:.0f}", axis.maxspeed);
  if (text == "get deviceid") return fmt::format("{}", 50000 + device);
  if (text.starts_with("move abs ")) {
    const double target = number_after("move abs ");
    if (target < 0 || target > kMicrosteps) return "!BADDATA";
    Start(axis, target - axis.offset, false);
    return "0";
  }
  if (text.starts_with("set maxspeed ")) {
    const double speed = number_after("set maxspeed ");
    if (speed < 1 || speed > kTopSpeed) return "!BADDATA";
    axis.maxspeed = speed;
    return "0";
  }
  return "!BADCOMMAND";
}

}  // namespace luxfield::fakes
