// What hands do between two frames of a window, told one thing after the other.
//
// A frame sees a key as down or up. On a busy machine a key goes down and up within one frame, and a
// drag passes in one: what a frame would hide waits here for the next one, in order.
#pragma once

#include <deque>
#include <map>
#include <vector>

namespace luxfield::view {

struct InputEvent {
  enum class Kind { kKey, kLetter, kButton, kMove, kWheel } kind = Kind::kKey;
  int code = 0;  // of the key or the button; the letter, in Unicode
  int scancode = 0, modifiers = 0;
  bool down = false;
  double x = 0, y = 0;    // where the pointer is, or notches of the wheel
  bool repeated = false;  // a button that goes down again soon, as in a double click
};

class InputQueue {
 public:
  // In the order of happening, which was after `after_s`, when events were taken from the system before,
  // and by `by_s`.
  void Push(InputEvent event, double after_s, double by_s);
  // What the next frame sees, in order: keys that change once each, a modifier before the others, with
  // their letters; or the pointer's way; or the wheel's; or one button.
  std::vector<InputEvent> Next();
  bool empty() const { return events_.empty(); }

 private:
  std::deque<InputEvent> events_;
  std::map<int, double> pressed_s_;  // `by_s` of a button that went down last
};

}  // namespace luxfield::view
