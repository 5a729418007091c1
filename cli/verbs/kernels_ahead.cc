#include "luxfield/cli/verbs/kernels_ahead.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/cache.h"
#include "luxfield/render/accuracy/pilot_kernels.h"

extern char** environ;

namespace luxfield::cli {
namespace {

constexpr const char* kProgram = "luxfield-verbs";  // others, as tests, have no verb `cache`

// -1 if it cannot be started: all is then compiled in this process.
pid_t Start(const std::filesystem::path& program, std::vector<std::string> words) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = -1;
  const int failed =
      posix_spawn(&process, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  return failed == 0 ? process : -1;
}

// Pilots of one luminaire alone are what is worth it.
bool MayBeAhead(const render::LitScene& scene, const RenderVerbOptions& options) {
  return !options.error.empty() && !options.estimator_given && scene.luminaires().size() == 1 &&
         !scene.environment() && !scene.has_strategies() &&
         options.render.shadows == render::Shadows::kTraced &&
         render::CompilesWhileRunning(scene.device());
}

// True once: that it was asked is kept. False where nothing can be kept.
bool IsFirst(const core::CacheKey& key) {
  if (core::FindInCache(key)) return false;
  core::PutIntoCache(key, "begun");
  return core::FindInCache(key).has_value();
}

}  // namespace

KernelsAhead::KernelsAhead(const render::LitScene& scene, const RenderVerbOptions& options) {
  if (!MayBeAhead(scene, options)) return;
  const bool glossy = scene.geometry().glossy;
  const auto key = render::PilotKernelsKey(
      scene.device(), glossy ? render::PilotSurfaces::kGlossy : render::PilotSurfaces::kLambertian);
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error || program.filename() != kProgram || !key || !IsFirst(*key)) return;
  std::vector<std::string> words{program.string(), "cache", "--compile",
                                 glossy ? "glossy" : "lambertian", "--quiet"};
  if (!options.device.empty()) words.insert(words.end(), {"--device", options.device});
  process_ = Start(program, words);
}

KernelsAhead::~KernelsAhead() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);  // PoCL renames files once they are whole
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace luxfield::cli
