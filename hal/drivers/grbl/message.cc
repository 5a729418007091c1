#include "luxfield/hal/drivers/grbl/message.h"

#include <charconv>
#include <cmath>

namespace luxfield::hal::grbl {
namespace {

constexpr std::array<std::string_view, 9> kStateNames = {"Idle", "Run",   "Hold", "Jog",  "Alarm",
                                                         "Door", "Check", "Home", "Sleep"};

// The whole text as a number.
template <typename Number>
std::optional<Number> Parse(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  if constexpr (std::is_floating_point_v<Number>)
    if (!std::isfinite(value)) return {};
  return value;
}

// What stands before the separator; `text` keeps what follows it.
std::string_view Take(std::string_view& text, char separator) {
  const auto at = text.find(separator);
  const std::string_view head = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return head;
}

// Three axes; controllers with more say those after them.
std::optional<Position> ParsePosition(std::string_view text) {
  Position position;
  for (double& axis : position) {
    const auto value = Parse<double>(Take(text, ','));
    if (!value) return {};
    axis = *value;
  }
  return position;
}

std::optional<Status> ParseStatus(std::string_view text) {
  Status status;
  std::string_view state = Take(text, '|');
  const std::string_view name = Take(state, ':');
  std::size_t index = 0;
  while (index < kStateNames.size() && kStateNames[index] != name) ++index;
  if (index == kStateNames.size()) return {};
  status.state = static_cast<State>(index);
  if (!state.empty()) {
    const auto substate = Parse<int>(state);
    if (!substate) return {};
    status.substate = *substate;
  }
  std::string_view where = Take(text, '|');
  const std::string_view frame = Take(where, ':');
  const auto position = ParsePosition(where);
  if ((frame != "MPos" && frame != "WPos") || !position) return {};
  status.position = *position;
  status.work_position = frame == "WPos";
  while (!text.empty()) {
    std::string_view value = Take(text, '|');
    const std::string_view key = Take(value, ':');
    if (key == "Pn") status.pins = value;
    if (key == "WCO") {
      status.work_offset = ParsePosition(value);
      if (!status.work_offset) return {};
    }
  }
  return status;
}

std::optional<int> CodeAfter(std::string_view line, std::string_view prefix) {
  if (!line.starts_with(prefix)) return {};
  const auto code = Parse<int>(line.substr(prefix.size()));
  return code && *code > 0 ? code : std::nullopt;
}

std::optional<Setting> ParseSetting(std::string_view line) {
  if (!line.starts_with('$')) return {};
  line.remove_prefix(1);
  const auto number = Parse<int>(Take(line, '='));
  // Some senders' firmware adds a description: "$0=10 (step pulse, usec)".
  const auto value = Parse<double>(line.substr(0, line.find(' ')));
  if (!number || *number < 0 || !value) return {};
  return Setting{*number, *value};
}

// What follows FluidNC's name, in its welcome and its version line.
std::optional<Firmware> ParseFluidNc(std::string_view text) {
  constexpr std::string_view kName = "FluidNC ";
  const auto at = text.find(kName);
  if (at == std::string_view::npos) return {};
  text.remove_prefix(at + kName.size());
  return Firmware{"FluidNC", std::string(Take(text, ' '))};
}

// "Grbl 1.1h ['$' for help]", "GrblHAL 1.1f ['$' or '$HELP' for help]",
// "Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]".
std::optional<Welcome> ParseWelcome(std::string_view line) {
  if (line.find(" for help]") == std::string_view::npos) return {};
  const std::string_view name = Take(line, ' ');
  if (name != "Grbl" && name != "GrblHAL") return {};
  if (auto fluid = ParseFluidNc(line)) return Welcome{*std::move(fluid)};
  return Welcome{{name == "Grbl" ? "Grbl" : "grblHAL", std::string(Take(line, ' '))}};
}

}  // namespace

std::string StateName(State state) {
  return std::string(kStateNames[static_cast<std::size_t>(state)]);
}

// "VER:1.1h.20190825:", "VER:3.9 FluidNC v3.9.1 (esp32-wifi) :".
Firmware ParseVersion(std::string_view line) {
  Take(line, ':');
  if (auto fluid = ParseFluidNc(line)) return *std::move(fluid);
  return {"Grbl", std::string(Take(line, ':'))};
}

Message ParseMessage(std::string_view line) {
  if (line == "ok") return Ok{};
  if (const auto code = CodeAfter(line, "error:")) return ErrorReply{*code};
  if (const auto code = CodeAfter(line, "ALARM:")) return Alarm{*code};
  if (const auto setting = ParseSetting(line)) return *setting;
  if (line.size() > 1 && line.front() == '<' && line.back() == '>')
    if (const auto status = ParseStatus(line.substr(1, line.size() - 2))) return *status;
  if (line.size() > 1 && line.front() == '[' && line.back() == ']')
    return Feedback{std::string(line.substr(1, line.size() - 2))};
  if (const auto welcome = ParseWelcome(line)) return *welcome;
  return Other{std::string(line)};
}

}  // namespace luxfield::hal::grbl
