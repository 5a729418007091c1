#include "luxfield/hal/instruments.h"

namespace luxfield::hal {

std::string Describe(const InputState& state) {
  std::string text;
  const auto add = [&text](bool is, const std::string& what) {
    if (is) text += (text.empty() ? "" : " and ") + what;
  };
  add(state.emergency_stop, "the emergency stop is active");
  add(state.door_open, "the door is open");
  add(state.limit, "a limit switch is hit");
  add(!state.unreadable.empty(), "the safety inputs cannot be read (" + state.unreadable + ")");
  return text;
}

}  // namespace luxfield::hal
