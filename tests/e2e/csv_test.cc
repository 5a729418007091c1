// Fields of comma-separated values that a spreadsheet shows and does not obey.
#include "luxfield/cli/reports/csv.h"

#include <gtest/gtest.h>

namespace luxfield::cli {
namespace {

TEST(CsvTest, TextThatSpreadsheetsWouldEvaluateIsTextToThem) {
  EXPECT_EQ(CsvText("=cmd|' /C calc'!A0"), "'=cmd|' /C calc'!A0");
  EXPECT_EQ(CsvText("+1"), "'+1");
  EXPECT_EQ(CsvText("-1+cmd"), "'-1+cmd");
  EXPECT_EQ(CsvText("@SUM(1,2)"), "\"'@SUM(1,2)\"");
  EXPECT_EQ(CsvText("\t=1"), "'\t=1");
  EXPECT_EQ(CsvText("C = 0 deg; a-b"), "C = 0 deg; a-b");
  EXPECT_EQ(CsvText(""), "");
}

TEST(CsvTest, WhatReadersWouldObeyIsShown) {
  EXPECT_EQ(CsvText("\r=1"), "\\x0d=1");
  EXPECT_EQ(CsvText("a\rb"), "a\\x0db");
  EXPECT_EQ(CsvText("a\x1b[31m\xc2\x9b\xe2\x80\xaez"), "a\\x1b[31m\\xc2\\x9b\\xe2\\x80\\xaez");
  EXPECT_EQ(CsvText("Stra\xc3\x9f"
                    "e"),
            "Stra\xc3\x9f"
            "e");
}

TEST(CsvTest, FieldsAreQuotedWhereTheyMustBe) {
  EXPECT_EQ(CsvText("a,b"), "\"a,b\"");
  EXPECT_EQ(CsvText("a\nb"), "\"a\nb\"");
  EXPECT_EQ(CsvText("a \"b\""), "\"a \"\"b\"\"\"");
}

// A number that is below zero is none to be disarmed.
TEST(CsvTest, NumbersStayNumbers) {
  EXPECT_EQ(Csv(core::Json::array({{{"name", "-1.5"}, {"value", -1.5}}})),
            "name,value\n'-1.5,-1.5\n");
  EXPECT_EQ(Csv(core::Json::array()), "");
}

TEST(CsvTest, RowsHaveAFieldForEachKey) {
  const core::Json rows = {{{"a", ""}, {"b", 1}, {"c", {1, 2}}},
                           {{"a", "x"}, {"b", nullptr}, {"c", 2}}};
  EXPECT_EQ(Csv(rows), "a,b,c\n,1,\"[1,2]\"\nx,null,2\n");
}

}  // namespace
}  // namespace luxfield::cli
