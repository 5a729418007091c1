// What a frame sees of what hands did.
#include "luxfield/view/window/input_queue.h"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <string>

namespace luxfield::view {
namespace {

using Kind = InputEvent::Kind;

class InputQueueTest : public testing::Test {
 protected:
  void Key(int code, bool down) { Push({.kind = Kind::kKey, .code = code, .down = down}); }
  void Letter(char letter) { Push({.kind = Kind::kLetter, .code = letter}); }
  void Button(bool down) { Push({.kind = Kind::kButton, .code = 0, .down = down}); }
  void Move(double x) { Push({.kind = Kind::kMove, .x = x}); }
  void Wheel() { Push({.kind = Kind::kWheel, .y = 1}); }
  void Push(const InputEvent& event) { queue_.Push(event, after_s_, by_s_); }

  // "C+" control down, "q-" the key Q up, "'" a letter, "B+" the button, "m" a move, "w" the wheel; a
  // blank between frames.
  std::string Frames() {
    std::string frames;
    while (!queue_.empty()) {
      if (!frames.empty()) frames += ' ';
      for (const InputEvent& event : queue_.Next()) {
        const char* sign = event.down ? "+" : "-";
        if (event.kind == Kind::kKey)
          frames += (event.code == GLFW_KEY_LEFT_CONTROL
                         ? "C"
                         : std::string(1, static_cast<char>(event.code + 'a' - 'A'))) +
                    sign;
        if (event.kind == Kind::kLetter) frames += "'";
        if (event.kind == Kind::kButton) frames += std::string(event.repeated ? "BB" : "B") + sign;
        if (event.kind == Kind::kMove) frames += "m";
        if (event.kind == Kind::kWheel) frames += "w";
      }
    }
    return frames;
  }

  InputQueue queue_;
  double after_s_ = 0, by_s_ = 0;
};

TEST_F(InputQueueTest, AKeyGoesDownAndUpInTwoFrames) {
  for (const bool down : {true, false, true, false}) Key(GLFW_KEY_Q, down);
  EXPECT_EQ(Frames(), "q+ q- q+ q-");
  EXPECT_TRUE(queue_.Next().empty());
}

TEST_F(InputQueueTest, LettersComeWithTheirKeys) {
  for (const int key : {GLFW_KEY_A, GLFW_KEY_B}) {
    Key(key, true);
    Letter(static_cast<char>(key));
  }
  Key(GLFW_KEY_A, false);
  EXPECT_EQ(Frames(), "a+'b+' a-");
}

// A modifier is of the keys that go down behind it.
TEST_F(InputQueueTest, AModifierGoesBeforeTheOthers) {
  Key(GLFW_KEY_LEFT_CONTROL, true);
  Key(GLFW_KEY_S, true);
  Key(GLFW_KEY_LEFT_CONTROL, false);
  Key(GLFW_KEY_S, false);
  Key(GLFW_KEY_Q, true);
  Key(GLFW_KEY_LEFT_CONTROL, true);
  EXPECT_EQ(Frames(), "C+s+ C-s-q+ C+");
}

TEST_F(InputQueueTest, ADragKeepsItsOrder) {
  Move(1);
  Move(2);
  Button(true);
  Move(3);
  Move(4);
  Button(false);
  Wheel();
  Wheel();
  Key(GLFW_KEY_Q, true);
  EXPECT_EQ(Frames(), "mm B+ mm B- ww q+");
}

TEST_F(InputQueueTest, TwoClicksAreADoubleOneByTheTimeBetweenThem) {
  const auto click = [&](double after_s, double by_s) {
    after_s_ = after_s;
    by_s_ = by_s;
    Button(true);
    Button(false);
  };
  click(1.0, 1.01);
  click(1.2, 1.21);
  EXPECT_EQ(Frames(), "B+ B- BB+ B-");
  click(2.0, 2.01);  // that frames between them took long tells nothing
  click(2.01, 4.0);
  EXPECT_EQ(Frames(), "B+ B- BB+ B-");
  click(5.0, 5.01);
  click(5.4, 5.41);
  EXPECT_EQ(Frames(), "B+ B- B+ B-");
}

}  // namespace
}  // namespace luxfield::view
