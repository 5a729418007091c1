// `luxfield view` on a session that is being captured, as a process of its own.
#pragma once

#include <sys/types.h>

#include <filesystem>

namespace luxfield::cli {

class SessionWindow {
 public:
  // Starts the program of `view` from beside this one, in a process group of its own, which Ctrl-C
  // does not reach, and at a low priority. To be made before devices are opened and sessions are
  // locked, as the process keeps what is open. Throws InputError where the program is not there.
  explicit SessionWindow(std::filesystem::path session);
  ~SessionWindow();  // closes it where no session came into being; else it stays
  bool IsOpen();     // whether its program still runs
  // Ends it, whatever it shows, and waits until it has ended.
  void Close();
  SessionWindow(const SessionWindow&) = delete;
  SessionWindow& operator=(const SessionWindow&) = delete;

 private:
  std::filesystem::path session_;
  pid_t process_ = -1;
};

}  // namespace luxfield::cli
