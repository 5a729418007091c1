#include "luxfield/core/printable.h"

#include <gtest/gtest.h>

namespace luxfield::core {
namespace {

TEST(Printable, HasNoBytesThatATerminalObeysAndNoMoreThanAskedFor) {
  EXPECT_EQ(Printable("ACME 7\x1b[31m\xd2\n~"), "ACME 7?[31m??~");
  EXPECT_EQ(Printable(std::string(100, 'a')), std::string(60, 'a'));
  EXPECT_EQ(Printable("abc", 2), "ab");
  EXPECT_EQ(Printable(std::string("\0b", 2)), "?b");
}

TEST(Visible, KeepsTextOfAnyLanguageAndShowsWhatATerminalObeys) {
  const std::string text =
      "Stra\xc3\x9f"
      "e, \xe7\x81\xaf, \xf0\x9f\x92\xa1\n\t~";
  EXPECT_EQ(Visible(text), text);
  EXPECT_EQ(Visible("\x1b[31mred\x07\r"), "\\x1b[31mred\\x07\\x0d");
  EXPECT_EQ(Visible("\xc2\x9b"  // U+009B, which some terminals take for ESC [
                    "1m"),
            "\\xc2\\x9b1m");
  EXPECT_EQ(Visible("a\xe2\x80\xae"  // U+202E, right to left
                    "b"),
            "a\\xe2\\x80\\xaeb");
  for (const char* mark : {"\u061c", "\u200e", "\u200f", "\u202a", "\u2066", "\u2069"})
    EXPECT_NE(Visible(mark), mark);
  for (const char* none :
       {"\u061b", "\u061d", "\u200d", "\u2010", "\u2029", "\u202f", "\u2065", "\u206a"})
    EXPECT_EQ(Visible(none), none);
  // No UTF-8: a byte of its own, an overlong '/', a surrogate, beyond U+10FFFF, cut off.
  EXPECT_EQ(Visible("\xff"), "\\xff");
  EXPECT_EQ(Visible("\xc0\xaf"), "\\xc0\\xaf");
  EXPECT_EQ(Visible("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(Visible("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(Visible("a\xe2\x80"), "a\\xe2\\x80");
  EXPECT_EQ(OnOneLine("a\nb\tc\r"), "a b c\\x0d");
}

TEST(Visible, IsTheSameInPiecesOfAnyLength) {
  const std::string text = "\xc3\x9f\x1b\xe7\x81\xaf\xf0\x9f\x92\xa1\xe7\x81z\xc2\x9b";
  for (std::size_t piece = 1; piece <= text.size(); ++piece) {
    VisibleText visible;
    std::string shown;
    for (std::size_t at = 0; at < text.size(); at += piece)
      shown += visible.Next(std::string_view(text).substr(at, piece));
    EXPECT_EQ(shown + visible.Rest(), Visible(text)) << piece;
  }
}

}  // namespace
}  // namespace luxfield::core
