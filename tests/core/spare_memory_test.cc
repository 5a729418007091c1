#include "luxfield/core/spare_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <new>

namespace luxfield::core {
namespace {

TEST(SpareMemory, IsThereOrIsMissed) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's shadow memory is beyond any limit of addresses";
#endif
  EXPECT_NO_THROW(RequireSpareMemory(kTextDrawingBytes));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
  rlimit tight = before;
  tight.rlim_cur = 1 << 20;  // less than this program holds
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &tight), 0);
  bool missed = false;
  try {
    RequireSpareMemory(1 << 20);
  } catch (const std::bad_alloc&) {
    missed = true;
  }
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &before), 0);
  EXPECT_TRUE(missed);
}

}  // namespace
}  // namespace luxfield::core
