// Waiting for what the kernel does in its own time.
#pragma once

#include <chrono>
#include <thread>

namespace luxfield::vm {

// Looks every few milliseconds; false if it is not so after half a minute.
template <typename Condition>
bool Await(Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace luxfield::vm
