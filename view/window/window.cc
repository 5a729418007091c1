#include "luxfield/view/window/window.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <filesystem>

#include "luxfield/core/error.h"

namespace luxfield::view {
namespace {

constexpr char kFont[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr float kFontSize = 15;
constexpr char kShaders[] = "#version 130";  // of OpenGL 3.0, which software renderers have

std::string g_glfw_error;

void KeepError(int, const char* description) { g_glfw_error = description; }

[[noreturn]] void FailToOpen() {
  throw DeviceError(
      fmt::format("no window can be opened: {}; start it where a display is, or under `xvfb-run`",
                  g_glfw_error.empty() ? "the system does not say why" : g_glfw_error));
}

// DejaVu Sans where Debian installs it, else the font that ImGui brings.
void LoadFont(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  if (std::filesystem::exists(kFont))
    io.Fonts->AddFontFromFileTTF(kFont, kFontSize * scale);
  else
    io.FontGlobalScale = scale;
}

void ChooseStyle(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.GrabRounding = 3;
  style.WindowBorderSize = 0;
  style.ScaleAllSizes(scale);
}

void ReadBack(WindowSize size, WindowPixels& pixels) {
  const std::size_t stride = 4 * static_cast<std::size_t>(size.width);
  std::vector<std::uint8_t> upwards(stride * size.height);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, size.width, size.height, GL_RGBA, GL_UNSIGNED_BYTE, upwards.data());
  pixels.size = size;
  pixels.rgba.resize(upwards.size());
  for (int row = 0; row < size.height; ++row)
    std::memcpy(pixels.rgba.data() + stride * row,
                upwards.data() + stride * (size.height - 1 - row), stride);
}

}  // namespace

void Window::CloseWindow::operator()(GLFWwindow* window) const {
  glfwDestroyWindow(window);
  glfwTerminate();
}

Window::Window(const std::string& title, WindowSize size)
    : title_(title), pointer_{-FLT_MAX, -FLT_MAX} {
  glfwSetErrorCallback(KeepError);
  if (!glfwInit()) FailToOpen();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  window_.reset(glfwCreateWindow(size.width, size.height, title.c_str(), nullptr, nullptr));
  if (!window_) {
    glfwTerminate();
    FailToOpen();
  }
  glfwMakeContextCurrent(window_.get());
  glfwSwapInterval(1);
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // nothing is left behind in the working folder
  float scale = 1, across = 1;
  glfwGetWindowContentScale(window_.get(), &scale, &across);
  scale = std::clamp(std::max(scale, across), 1.0f, 4.0f);
  LoadFont(scale);
  ChooseStyle(scale);
  ListenToHands();
  ImGui_ImplGlfw_InitForOpenGL(window_.get(), false);
  ImGui_ImplOpenGL3_Init(kShaders);
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Window::SetTitle(const std::string& title) {
  if (title == title_) return;
  title_ = title;
  glfwSetWindowTitle(window_.get(), title_.c_str());
}

bool Window::ShouldClose() const { return glfwWindowShouldClose(window_.get()); }

void Window::Close() { glfwSetWindowShouldClose(window_.get(), GLFW_TRUE); }

void Window::StayOpen() { glfwSetWindowShouldClose(window_.get(), GLFW_FALSE); }

void Window::Wake() { glfwPostEmptyEvent(); }

WindowSize Window::size() const {
  WindowSize size;
  glfwGetFramebufferSize(window_.get(), &size.width, &size.height);
  return size;
}

double Window::density() const {
  WindowSize outer;
  glfwGetWindowSize(window_.get(), &outer.width, &outer.height);
  return outer.width > 0 ? static_cast<double>(size().width) / outer.width : 1.0;
}

Window& Window::Of(GLFWwindow* window) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

void Window::Take(const InputEvent& event) { input_.Push(event, polled_s_, glfwGetTime()); }

void Window::ListenToHands() {
  using Kind = InputEvent::Kind;
  GLFWwindow* window = window_.get();
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int scancode, int action, int modifiers) {
    if (action != GLFW_REPEAT)  // which ImGui makes by itself
      Of(w).Take({Kind::kKey, key, scancode, modifiers, action == GLFW_PRESS});
  });
  glfwSetCharCallback(window, [](GLFWwindow* w, unsigned letter) {
    Of(w).Take({Kind::kLetter, static_cast<int>(letter)});
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int modifiers) {
    Of(w).Take({Kind::kButton, button, 0, modifiers, action == GLFW_PRESS});
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    Of(w).Take({.kind = Kind::kMove, .x = x, .y = y});
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double right, double up) {
    Of(w).Take({.kind = Kind::kWheel, .x = right, .y = up});
  });
  glfwSetCursorEnterCallback(window, [](GLFWwindow* w, int inside) {
    ImGui_ImplGlfw_CursorEnterCallback(w, inside);
    if (!inside && glfwGetMouseButton(w, GLFW_MOUSE_BUTTON_LEFT) == GLFW_RELEASE)
      Of(w).Take({.kind = Kind::kMove, .x = -FLT_MAX, .y = -FLT_MAX});
  });
  glfwSetWindowFocusCallback(window, ImGui_ImplGlfw_WindowFocusCallback);
}

void Window::TellHands() {
  using Kind = InputEvent::Kind;
  ImGuiIO& io = ImGui::GetIO();
  for (const InputEvent& event : input_.Next()) {
    switch (event.kind) {
      case Kind::kKey:
        ImGui_ImplGlfw_KeyCallback(window_.get(), event.code, event.scancode,
                                   event.down ? GLFW_PRESS : GLFW_RELEASE, event.modifiers);
        break;
      case Kind::kLetter:
        io.AddInputCharacter(static_cast<unsigned>(event.code));
        break;
      case Kind::kButton:
        if (event.code >= static_cast<int>(buttons_.size())) break;
        buttons_[event.code] = event.down;
        // ImGui's own clock goes by frames, of which a slow one may lie between two clicks.
        if (event.down) io.MouseDoubleClickTime = event.repeated ? FLT_MAX : 0;
        break;
      case Kind::kMove:
        pointer_ = {event.x, event.y};
        break;
      case Kind::kWheel:
        ImGui_ImplGlfw_ScrollCallback(window_.get(), event.x, event.y);
        break;
    }
  }
  const ImVec2 at(static_cast<float>(pointer_[0]), static_cast<float>(pointer_[1]));
#if IMGUI_VERSION_NUM >= 18700
  io.AddMousePosEvent(at.x, at.y);
  for (std::size_t i = 0; i < buttons_.size(); ++i)
    io.AddMouseButtonEvent(static_cast<int>(i), buttons_[i]);
#else
  io.MousePos = at;
  std::ranges::copy(buttons_, io.MouseDown);
#endif
}

bool Window::BeginFrame(double wait_s) {
  if (wait_s > 0 && input_.empty())
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
  polled_s_ = glfwGetTime();
  if (size().width <= 0 || size().height <= 0) return false;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  TellHands();
  ImGui::NewFrame();
  return true;
}

void Window::EndFrame(WindowPixels* pixels) {
  ImGui::Render();
  const WindowSize drawn = size();
  glViewport(0, 0, drawn.width, drawn.height);
  glClearColor(0.08f, 0.08f, 0.09f, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  if (pixels) ReadBack(drawn, *pixels);
  glfwSwapBuffers(window_.get());
}

}  // namespace luxfield::view
