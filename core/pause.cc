#include "luxfield/core/pause.h"

#include <csignal>

namespace luxfield::core {
namespace {

volatile std::sig_atomic_t g_wanted = 0;

void Toggle(int) { g_wanted = !g_wanted; }

}  // namespace

void InstallPauseHandler() {
  struct sigaction action {};
  action.sa_handler = &Toggle;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGTSTP, &action, nullptr);
}

bool PauseWanted() { return g_wanted != 0; }
void SetPauseWantedForTest(bool wanted) { g_wanted = wanted; }

}  // namespace luxfield::core
