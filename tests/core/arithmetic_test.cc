// What the compiler must not take away.
#include <gtest/gtest.h>

#include <array>

namespace luxfield::core {
namespace {

[[gnu::noinline, gnu::noclone]] std::array<double, 3> RoundedToFloat(
    const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

TEST(Arithmetic, NeighbouringDoublesRoundToFloat) {
  const auto rounded = RoundedToFloat({0.013, 0.0075, 0.1});
  EXPECT_EQ(rounded[0], 0x1.a9fbe8p-7);
  EXPECT_EQ(rounded[1], 0x1.eb851ep-8);
  EXPECT_EQ(rounded[2], 0x1.99999ap-4);
}

}  // namespace
}  // namespace luxfield::core
