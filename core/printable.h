// Text from files and devices, in messages and on terminals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace luxfield::core {

// Its first bytes, '?' in place of what is not printable ASCII.
std::string Printable(std::string_view text, std::size_t most = 60);

struct Character {
  std::size_t bytes = 0;  // that it takes; 0 where they are none
  std::uint32_t code = 0;
  bool cut_off = false;  // it goes on beyond the text
};
// The one that UTF-8 text begins with, which must not be empty.
Character FirstCharacter(std::string_view text);

// UTF-8 text in pieces, with what a terminal or a reader would obey instead of showing as \xNN:
// control characters other than newline and tab (U+0000 to U+001F, U+007F to U+009F), those of the
// direction of writing (U+061C, U+200E, U+200F, U+202A to U+202E, U+2066 to U+2069), bytes that are
// no UTF-8.
class VisibleText {
 public:
  // A character that the piece cuts off waits for the next one.
  std::string Next(std::string_view piece);
  std::string Rest();  // what waits

 private:
  std::string waiting_;
};

// The same of a whole text; OnOneLine has a space in place of newlines and tabs, too.
std::string Visible(std::string_view text);
std::string OnOneLine(std::string_view text);

// UTF-8 text as content or attribute of an XML or HTML element, with & < > " as entities.
std::string EscapedMarkup(std::string_view text);

// For the escape sequences that the program itself sends to the terminal on stderr, past what makes
// text visible on the way there.
void ObeyedByTerminal(std::string_view sequence);

}  // namespace luxfield::core
