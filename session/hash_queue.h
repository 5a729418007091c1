// Hashes behind the caller's back.
#pragma once

#include <cstddef>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <string>

#include "luxfield/core/sha256.h"
#include "luxfield/session/background_queue.h"

namespace luxfield::session {

// SHA-256 of one message after the other, on a thread of its own; of those that wait together,
// which takes less time for each: the further it falls behind, the faster it gets. Push is for one
// thread.
class HashQueue {
 public:
  // `most` messages may wait.
  explicit HashQueue(std::size_t most);
  // Waits for room. `owner` keeps the message's bytes.
  std::shared_future<std::string> Push(const core::Sha256Message& message,
                                       std::shared_ptr<const void> owner);

 private:
  struct Waiting {
    core::Sha256Message message;
    std::shared_ptr<const void> owner;
    std::promise<std::string> sha256 = {};
  };
  void HashWhatWaits();

  std::mutex mutex_;  // of what follows
  std::deque<Waiting> waiting_;
  BackgroundQueue thread_;  // a task per message, of which the first takes all that wait
};

}  // namespace luxfield::session
