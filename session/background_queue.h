// Work behind the caller's back.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace luxfield::session {

// One task after the other, on a thread of its own, which gives way to the caller's: it has a lower
// priority. Push and Settle are for one thread.
class BackgroundQueue {
 public:
  // `most` tasks may wait for the one that is being done.
  explicit BackgroundQueue(std::size_t most);
  ~BackgroundQueue();  // does what waits, and keeps quiet about what goes wrong
  BackgroundQueue(const BackgroundQueue&) = delete;
  BackgroundQueue& operator=(const BackgroundQueue&) = delete;

  // Waits for room. Throws what an earlier task threw; nothing is done after that one.
  void Push(std::function<void()> task);
  // Whether something waits for the task that is being done: for that task.
  bool Waiting();
  // Waits until everything is done. Throws likewise, and the queue can be used again.
  void Settle();

 private:
  void Work();
  void ThrowWhatWentWrong();

  const std::size_t most_;
  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;  // the first one is being done
  std::exception_ptr error_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace luxfield::session
