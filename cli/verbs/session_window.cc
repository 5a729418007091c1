#include "luxfield/cli/verbs/session_window.h"

#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <string>
#include <utility>

#include "luxfield/core/error.h"

extern char** environ;

namespace luxfield::cli {
namespace {

constexpr char kProgram[] = "luxfield-view";
constexpr int kNiceness = 10;

}  // namespace

SessionWindow::SessionWindow(std::filesystem::path session) : session_(std::move(session)) {
  std::error_code error;
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kProgram).string();
  std::string words[] = {program, "view", session_.string(), "--wait"};
  char* arguments[] = {words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int failed =
      posix_spawn(&process_, program.c_str(), nullptr, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  if (failed != 0)
    throw InputError("--view", "needs " + program + ", which is not there",
                     "build or install `luxfield view`, or drop --view");
  setpriority(PRIO_PROCESS, static_cast<id_t>(process_), kNiceness);
}

bool SessionWindow::IsOpen() {
  if (process_ >= 0 && waitpid(process_, nullptr, WNOHANG) != 0) process_ = -1;
  return process_ >= 0;
}

void SessionWindow::Close() {
  if (process_ < 0) return;
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
  process_ = -1;
}

SessionWindow::~SessionWindow() {
  if (process_ < 0) return;
  if (!std::filesystem::exists(session_)) kill(process_, SIGTERM);
  waitpid(process_, nullptr, WNOHANG);
}

}  // namespace luxfield::cli
