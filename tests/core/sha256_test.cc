#include "luxfield/core/sha256.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "luxfield/core/file.h"
#include "luxfield/core/random.h"

namespace luxfield::core {
namespace {

// FIPS 180-2, appendix B.
const std::string kOneBlock = "abc",
                  kTwoBlocks = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
                  kLong(1000000, 'a');
constexpr const char *kHashOfNothing =
                         "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
                     *kHashOfOneBlock =
                         "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
                     *kHashOfTwoBlocks =
                         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1",
                     *kHashOfLong =
                         "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";

TEST(Sha256OfEach, KnownVectors) {
  const std::vector<Sha256Message> messages = {
      {{}, kTwoBlocks}, {{}, {}}, {{}, kOneBlock}, {{}, kLong}};
  const std::vector<std::string> hashes = {kHashOfTwoBlocks, kHashOfNothing, kHashOfOneBlock,
                                           kHashOfLong};
  EXPECT_EQ(Sha256OfEach(messages), hashes);
  ASSERT_THAT(Sha256Ways(), testing::Contains(Sha256Way::kOneByOne));
  for (const Sha256Way way : Sha256Ways()) {
    SCOPED_TRACE(static_cast<int>(way));
    EXPECT_EQ(Sha256OfEach(messages, way), hashes);
    for (std::size_t n = 0; n < messages.size(); ++n)
      EXPECT_THAT(Sha256OfEach(std::span(messages).subspan(n, 1), way),
                  testing::ElementsAre(hashes[n]));
    EXPECT_THAT(Sha256OfEach({}, way), testing::IsEmpty());
  }
}

TEST(Sha256OfEach, AnyNumberOfAnyLengthsAsOneByOne) {
  Random random(1, 0);
  std::string bytes(20000, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  for (int round = 0; round < 200; ++round) {
    std::vector<Sha256Message> messages(random() % 20);
    std::vector<std::string> expected;
    for (Sha256Message& message : messages) {
      // All lengths modulo a block, where the padding takes one block more too.
      const std::size_t head = kSha256Block * (random() % 4),
                        size = random() % (round % 2 ? 200 : 10000), at = random() % 9000;
      message = {std::string_view(bytes).substr(at, head),
                 std::string_view(bytes).substr(random() % 9000, size)};
      expected.push_back(Sha256(std::string(message.head) + std::string(message.body)));
    }
    ASSERT_EQ(Sha256OfEach(messages), expected);
    for (const Sha256Way way : Sha256Ways())
      ASSERT_EQ(Sha256OfEach(messages, way), expected)
          << "way " << static_cast<int>(way) << ", round " << round;
  }
}

}  // namespace
}  // namespace luxfield::core
