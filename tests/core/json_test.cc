#include "luxfield/core/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace luxfield::core {
namespace {

template <typename T>
std::string ErrorOf(const char* value) {
  try {
    Field<T>(Json{{"count", Json::parse(value)}}, "count", "session.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(JsonField, WholeNumbersThatDoNotFitAreRefused) {
  for (const char* value : {"2147483648", "-2147483649", "1.5", "1e300", "-1e300", "true", "\"1\"",
                            "18446744073709551615", "null", "[]"})
    EXPECT_THAT(ErrorOf<int>(value), testing::HasSubstr("field 'count' = ")) << value;
  for (const char* value : {"-1", "18446744073709551616", "3e+32", "0.5"})
    EXPECT_NE(ErrorOf<std::uint64_t>(value), "") << value;
  EXPECT_EQ(Field<int>({{"count", -2147483648}}, "count", ""), -2147483648);
  EXPECT_EQ(Field<int>({{"count", 3.0}}, "count", ""), 3);
  EXPECT_EQ(Field<std::uint64_t>({{"count", ~std::uint64_t{0}}}, "count", ""), ~std::uint64_t{0});
}

TEST(JsonField, NorAreTheyInLists) {
  using Pairs = std::vector<std::pair<int, int>>;
  EXPECT_EQ(Field<Pairs>(Json::parse(R"({"count": [[1, 2], [3, 4]]})"), "count", ""),
            (Pairs{{1, 2}, {3, 4}}));
  for (const char* value :
       {"[[1, 2], [3, 1e300]]", "[[1, 2, 3]]", "[[1]]", "[1]", "{\"a\": [1, 2]}"})
    EXPECT_NE(ErrorOf<Pairs>(value), "") << value;
}

// Finite, and no larger than that products of ten are.
TEST(JsonField, NumbersBeyondMeasureAreRefused) {
  for (const char* value : {"1e308", "-1e308", "1.1e30", "\"1\"", "null", "[1]"}) {
    EXPECT_THAT(ErrorOf<double>(value), testing::HasSubstr("field 'count' = ")) << value;
    EXPECT_THAT(ErrorOf<double>(value), testing::HasSubstr("session.json")) << value;
  }
  EXPECT_NE(ErrorOf<std::vector<double>>("[1, 2e300]"), "");
  EXPECT_EQ(Field<double>({{"count", -1e30}}, "count", ""), -1e30);
  EXPECT_EQ(Field<double>({{"count", 7}}, "count", ""), 7);
  const auto in_range = [](double value) {
    return NumberField({{"count", value}}, "count", "session.json", {1, 2}, "count again");
  };
  EXPECT_EQ(in_range(1), 1);
  EXPECT_EQ(in_range(2), 2);
  for (const double value : {0.999, 2.001, -1e30})
    EXPECT_THAT([&] { in_range(value); },
                testing::ThrowsMessage<InputError>(testing::AllOf(
                    testing::HasSubstr("session.json: count = "),
                    testing::HasSubstr("between 1 and 2"), testing::HasSubstr("count again"))));
}

// As deep as the stack would not hold.
TEST(Json, NestedValuesEndInAnErrorAndNotTheProgram) {
  const std::string open(300'000, '['), close(300'000, ']');
  for (const std::string& text : {"{\"count\": " + open + close + "}", open, "[" + open + "1"})
    EXPECT_THROW(ParseJson(text, "session.json"), InputError);
  const std::string some(90, '['), end(90, ']');
  EXPECT_THAT(ErrorOf<int>((some + end).c_str()), testing::HasSubstr("wrong type"));
  EXPECT_EQ(ParseJson("{\"count\": " + some + end + "}", "")["count"].size(), 1u);
}

}  // namespace
}  // namespace luxfield::core
