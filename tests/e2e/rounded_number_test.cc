// Numbers as pages and certificates print them, and the columns that they stand in.
#include "luxfield/cli/reports/rounded_number.h"

#include <gtest/gtest.h>

#include "luxfield/cli/table_columns.h"

namespace luxfield::cli {
namespace {

TEST(RoundedNumber, HasTheDigitsOfItsUncertainty) {
  struct Case {
    double value, u;
    const char *rounded, *uncertainty;
  };
  for (const Case& c : {Case{2.4863, 0.13, "2.49", "0.13"},
                        {0.87299, 2.4, "0.9", "2.4"},
                        {147240, 620, "147240", "620"},
                        {147240, 6200, "147200", "6200"},
                        {5.8, 0.0996, "5.80", "0.10"},
                        {0.005998, 2.2e-5, "0.005998", "0.000022"},
                        {3.612e-7, 2.8e-7, "3.6e-07", "2.8e-07"},
                        {-5.2e-9, 0.01, "0.000", "0.010"},
                        {-0.04, 2.4, "0.0", "2.4"},
                        {1.23456789e10, 1e7, "1.2346e+10", "10000000"},
                        {-648.01, 1.1, "-648.0", "1.1"}}) {
    EXPECT_EQ(RoundedTo(c.value, c.u), c.rounded) << c.value << " +- " << c.u;
    EXPECT_EQ(UncertaintyText(c.u), c.uncertainty) << c.u;
  }
  EXPECT_EQ(RoundedTo(-0.0, 0.0), "0");
  EXPECT_EQ(UncertaintyText(0), "0");
}

TEST(RoundedNumber, WithoutUncertaintyHasFiveDigits) {
  EXPECT_EQ(RoundedTo(147243.2, {}), "147240");
  EXPECT_EQ(Digits(0.0062117), "0.0062117");
  EXPECT_EQ(Digits(3570.0), "3570");
  EXPECT_EQ(Digits(999999.5), "1000000");
  EXPECT_EQ(Digits(-0.0), "0");
  EXPECT_EQ(Digits(1.2e-7), "1.2e-07");
  EXPECT_EQ(Digits(2.5e9), "2.5e+09");
}

TEST(TableColumns, OfNumbersAreThoseWithMoreNumbersThanNames) {
  EXPECT_EQ(NumberColumns({{"51 points", "value", "where", "limit", "probability", ""},
                           {"75R", "-3.2", "2.50° R, 1.00° U", "≥ 3 cd", "> 0.999", "pass"},
                           {"50L", "0.57°", "0°, 1.00° D", "≤ 3 cd", "0.5", "fail"},
                           {"Zone", "", "all of it", "", "", ""}}),
            (std::vector<bool>{false, true, false, false, true, false}));
}

}  // namespace
}  // namespace luxfield::cli
