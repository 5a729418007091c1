#include "tests/hostile/reload.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "luxfield/view/documents/scene_document.h"

namespace luxfield::hostile {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kTakesNotice = 3s;  // a file that stays the same is read after a second at most
constexpr auto kSettles = 60s;

bool Settles(view::Document& document) {
  const auto until = std::chrono::steady_clock::now() + kSettles;
  while (std::chrono::steady_clock::now() < until) {
    document.Update();
    if (document.Settled()) return true;
    std::this_thread::sleep_for(1ms);
  }
  return false;
}

// Until the document reads again, or has had the time to.
void TakeNotice(view::Document& document) {
  const auto until = std::chrono::steady_clock::now() + kTakesNotice;
  while (document.Settled() && std::chrono::steady_clock::now() < until) {
    document.Update();
    std::this_thread::sleep_for(1ms);
  }
}

}  // namespace

int Reload(const std::string& scene, const std::vector<std::string>& names) {
  view::SceneOptions options;
  options.file = scene;
  options.width = 16;
  options.height = 12;
  options.error = 0.2;
  options.shadows = false;
  const auto kind = scene.ends_with(".exr") ? view::SceneKind::kStage : view::SceneKind::kScene;
  const auto document = view::OpenScene(options, kind);
  if (!Settles(*document)) return 1;
  if (const auto failure = document->failure()) {
    fmt::print(stderr, "luxfield: {}\n", failure->sentence);
    return 2;
  }
  for (const std::string& name : names) {
    const auto before = fs::last_write_time(name);
    fs::remove_all(name);
    fs::rename("new/" + name, name);
    std::error_code not_told;  // what is no file may have no time
    fs::last_write_time(name, before + 10s, not_told);
  }
  TakeNotice(*document);
  if (!Settles(*document)) return 1;
  fmt::print("{}\n", document->Status());
  return !document->failure() && document->picture() ? 0 : 1;
}

}  // namespace luxfield::hostile
