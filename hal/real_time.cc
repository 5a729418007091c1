#include "luxfield/hal/real_time.h"

#include <sched.h>

namespace luxfield::hal {

bool RaisePriority(pthread_t thread) {
  sched_param priority{};
  priority.sched_priority = 20;
  return pthread_setschedparam(thread, SCHED_FIFO, &priority) == 0;
}

}  // namespace luxfield::hal
