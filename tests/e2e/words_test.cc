// How the program words numbers.
#include <gtest/gtest.h>

#include "luxfield/cli/program.h"

namespace luxfield::cli {
namespace {

TEST(Words, BytesAreInTheLargestUnitThatHoldsOne) {
  EXPECT_EQ(FormatBytes(0), "0 B");
  EXPECT_EQ(FormatBytes(1023), "1023 B");
  EXPECT_EQ(FormatBytes(1024), "1.0 KiB");
  EXPECT_EQ(FormatBytes(1536), "1.5 KiB");
  EXPECT_EQ(FormatBytes(1024.0 * 1024), "1.0 MiB");
  EXPECT_EQ(FormatBytes(2.5 * 1024 * 1024 * 1024), "2.5 GiB");
  EXPECT_EQ(FormatBytes(3e4 * 1024 * 1024 * 1024 * 1024), "30000.0 TiB");
}

}  // namespace
}  // namespace luxfield::cli
