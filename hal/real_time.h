// Threads that no ordinary program may keep waiting.
#pragma once

#include <pthread.h>

namespace luxfield::hal {

// Puts the thread above ordinary programs and below the kernel's own threads. False, and nothing
// done, where the system refuses (docs/safety.md says how to allow it).
bool RaisePriority(pthread_t thread);

}  // namespace luxfield::hal
