#include "luxfield/session/background_queue.h"

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <utility>

namespace luxfield::session {
namespace {

// The calling thread's. Linux' nice values are those of threads.
void LowerPriority() {
  constexpr int kNicer = 5;
  int policy = SCHED_OTHER;
  sched_param priority{};
  ::pthread_getschedparam(::pthread_self(), &policy, &priority);
  if (policy == SCHED_FIFO || policy == SCHED_RR) {
    priority.sched_priority =
        std::max(priority.sched_priority - 1, ::sched_get_priority_min(policy));
    ::pthread_setschedparam(::pthread_self(), policy, &priority);
  } else {
    ::setpriority(PRIO_PROCESS, 0, ::getpriority(PRIO_PROCESS, 0) + kNicer);
  }
}

}  // namespace

BackgroundQueue::BackgroundQueue(std::size_t most) : most_(most), thread_([this] { Work(); }) {}

BackgroundQueue::~BackgroundQueue() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BackgroundQueue::ThrowWhatWentWrong() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void BackgroundQueue::Push(std::function<void()> task) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return tasks_.size() <= most_; });
  ThrowWhatWentWrong();
  tasks_.push_back(std::move(task));
  changed_.notify_all();
}

bool BackgroundQueue::Waiting() {
  const std::lock_guard lock(mutex_);
  return tasks_.size() > 1;
}

void BackgroundQueue::Settle() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return tasks_.empty(); });
  ThrowWhatWentWrong();
}

void BackgroundQueue::Work() {
  LowerPriority();
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const std::function<void()>& task = tasks_.front();
    lock.unlock();
    std::exception_ptr error;
    try {
      task();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    tasks_.pop_front();
    if (error) {
      error_ = error;
      tasks_.clear();
    }
    changed_.notify_all();
  }
}

}  // namespace luxfield::session
