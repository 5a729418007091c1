#include "luxfield/session/hash_queue.h"

#include <exception>
#include <utility>
#include <vector>

namespace luxfield::session {

HashQueue::HashQueue(std::size_t most) : thread_(most) {}

std::shared_future<std::string> HashQueue::Push(const core::Sha256Message& message,
                                                std::shared_ptr<const void> owner) {
  std::shared_future<std::string> sha256;
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({message, std::move(owner)});
    sha256 = waiting_.back().sha256.get_future().share();
  }
  thread_.Push([this] { HashWhatWaits(); });
  return sha256;
}

void HashQueue::HashWhatWaits() {
  std::vector<Waiting> group;
  {
    const std::lock_guard lock(mutex_);
    for (; !waiting_.empty() && group.size() < core::kSha256Lanes; waiting_.pop_front())
      group.push_back(std::move(waiting_.front()));
  }
  std::vector<core::Sha256Message> messages;
  for (const Waiting& one : group) messages.push_back(one.message);
  std::vector<std::string> hashes;
  try {
    hashes = core::Sha256OfEach(messages);
  } catch (...) {
    for (Waiting& one : group) one.sha256.set_exception(std::current_exception());
    return;
  }
  for (std::size_t n = 0; n < group.size(); ++n) group[n].sha256.set_value(std::move(hashes[n]));
}

}  // namespace luxfield::session
