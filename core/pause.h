// Ctrl-Z: a long job rests at its next safe place, and goes on at the next Ctrl-Z.
#pragma once

namespace luxfield::core {

// From here on SIGTSTP does not stop the process, which a watchdog would take for a hang, but turns
// PauseWanted() on, and off again.
void InstallPauseHandler();
bool PauseWanted();
void SetPauseWantedForTest(bool wanted);

}  // namespace luxfield::core
