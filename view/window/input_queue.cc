#include "luxfield/view/window/input_queue.h"

#include <GLFW/glfw3.h>

#include <algorithm>

namespace luxfield::view {
namespace {

using Kind = InputEvent::Kind;

constexpr double kDoubleClick_s = 0.3;

bool IsModifier(int key) { return key >= GLFW_KEY_LEFT_SHIFT && key <= GLFW_KEY_RIGHT_SUPER; }

bool IsOfKeyboard(const InputEvent& event) {
  return event.kind == Kind::kKey || event.kind == Kind::kLetter;
}

// Whether a frame that sees `seen`, which is something, can see `next` as well.
bool Fits(const std::vector<InputEvent>& seen, const InputEvent& next) {
  if (IsOfKeyboard(next) != IsOfKeyboard(seen[0])) return false;
  if (!IsOfKeyboard(next)) return next.kind == seen[0].kind && next.kind != Kind::kButton;
  if (next.kind == Kind::kLetter) return true;
  return std::ranges::none_of(seen, [&](const InputEvent& event) {
    return event.kind == Kind::kKey &&
           (event.code == next.code || (IsModifier(next.code) && !IsModifier(event.code)));
  });
}

}  // namespace

void InputQueue::Push(InputEvent event, double after_s, double by_s) {
  if (event.kind == Kind::kButton && event.down) {
    const auto before = pressed_s_.find(event.code);
    event.repeated = before != pressed_s_.end() && after_s - before->second < kDoubleClick_s;
    pressed_s_[event.code] = by_s;
  }
  events_.push_back(event);
}

std::vector<InputEvent> InputQueue::Next() {
  std::vector<InputEvent> seen;
  while (!events_.empty() && (seen.empty() || Fits(seen, events_.front()))) {
    seen.push_back(events_.front());
    events_.pop_front();
  }
  return seen;
}

}  // namespace luxfield::view
