#include "luxfield/session/hash_queue.h"

#include <gtest/gtest.h>

#include <vector>

#include "luxfield/core/file.h"

namespace luxfield::session {
namespace {

TEST(HashQueue, EveryMessageGetsItsHashAndIsKeptUntilThen) {
  std::vector<std::string> expected;
  std::vector<std::weak_ptr<const std::string>> kept;
  std::vector<std::shared_future<std::string>> hashes;
  {
    HashQueue queue(5);
    for (std::size_t n = 0; n < 100; ++n) {
      // The first ones take longer than it takes to push the others, which are hashed together.
      const auto bytes = std::make_shared<const std::string>(n < 3 ? 1'000'000 : 1000 + 10 * n,
                                                             static_cast<char>(n));
      expected.push_back(core::Sha256(*bytes));
      kept.push_back(bytes);
      hashes.push_back(queue.Push({{}, *bytes}, bytes));
    }
  }
  for (std::size_t n = 0; n < hashes.size(); ++n) {
    EXPECT_EQ(hashes[n].get(), expected[n]) << n;
    EXPECT_TRUE(kept[n].expired()) << n;
  }
}

}  // namespace
}  // namespace luxfield::session
