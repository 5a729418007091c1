#include "luxfield/view/window/window.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
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

Window::Window(const std::string& title, WindowSize size) {
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
  ImGui_ImplGlfw_InitForOpenGL(window_.get(), true);
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

bool Window::BeginFrame(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
  if (size().width <= 0 || size().height <= 0) return false;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
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
