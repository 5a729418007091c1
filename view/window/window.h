// A window with an OpenGL context and Dear ImGui in it: opened, drawn into frame by frame, read back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/view/window/input_queue.h"

struct GLFWwindow;

namespace luxfield::view {

struct WindowSize {
  int width = 0, height = 0;
};

// 8-bit RGBA, row 0 on top.
struct WindowPixels {
  WindowSize size;
  std::vector<std::uint8_t> rgba;
};

class Window {
 public:
  // Throws DeviceError where there is no display or no OpenGL 3. One at a time in a process.
  Window(const std::string& title, WindowSize size);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void SetTitle(const std::string& title);
  bool ShouldClose() const;
  void Close();
  void StayOpen();  // whatever asked it to close
  // Takes events, waiting up to `wait_s` for one, and begins a frame. False while the window has no
  // area (minimised, or resized to nothing): then nothing is to be drawn, and EndFrame not called.
  bool BeginFrame(double wait_s);
  // Draws what ImGui was told, and shows it; `pixels`, if not null, receives it.
  void EndFrame(WindowPixels* pixels = nullptr);
  // From any thread: ends a wait of BeginFrame.
  static void Wake();

  WindowSize size() const;  // in pixels of the framebuffer
  // Pixels of the framebuffer per unit of ImGui's coordinates.
  double density() const;

 private:
  static Window& Of(GLFWwindow* window);
  void ListenToHands();
  void Take(const InputEvent& event);
  // Tells ImGui what the next frame sees of what hands did.
  void TellHands();

  struct CloseWindow {
    void operator()(GLFWwindow* window) const;
  };
  std::unique_ptr<GLFWwindow, CloseWindow> window_;
  std::string title_;
  InputQueue input_;
  double polled_s_ = 0;  // when events were taken from the system last
  std::array<double, 2> pointer_;
  std::array<bool, 5> buttons_{};
};

}  // namespace luxfield::view
