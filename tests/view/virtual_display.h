// An X server without a screen, for windows under test.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace luxfield::view {

class VirtualDisplay {
 public:
  // Starts Xvfb and sets $DISPLAY to it; empty where there is no Xvfb.
  static std::optional<VirtualDisplay> Start();
  ~VirtualDisplay();  // ends the server and unsets $DISPLAY
  VirtualDisplay(VirtualDisplay&& other) noexcept;
  VirtualDisplay& operator=(VirtualDisplay&&) = delete;

 private:
  explicit VirtualDisplay(pid_t server) : server_(server) {}
  pid_t server_ = -1;
};

}  // namespace luxfield::view
