#include "core/printable.h"

#include <gtest/gtest.h>

namespace luxfield::core {
namespace {

TEST(Printable, HasNoBytesThatATerminalObeysAndNoMoreThanAskedFor) {
  EXPECT_EQ(Printable("ACME 7\x1b[31m\xd2\n~"), "ACME 7?[31m??~");
  EXPECT_EQ(Printable(std::string(100, 'a')), std::string(60, 'a'));
  EXPECT_EQ(Printable("abc", 2), "ab");
  EXPECT_EQ(Printable(std::string("\0b", 2)), "?b");
}

}  // namespace
}  // namespace luxfield::core
