// Lines and numbers of text that other programs wrote, with sentences that name file, line and
// field.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::formats {

// No photometric file is longer: 64 MiB.
inline constexpr std::size_t kMostText = 1 << 26;

std::string_view Trimmed(std::string_view text);

// The text as it is where it is UTF-8, else every byte as a character of ISO-8859-1.
std::string Utf8FromLatin1(std::string_view text);

class TextReader {
 public:
  TextReader(std::string_view text, std::string file);

  bool AtEnd() const { return next_ == lines_.size(); }

  // The next line, trimmed, as UTF-8. InputError where there is none.
  std::string Line(const char* field);

  // The next number of a list that commas, blanks and line ends separate.
  double Number(const char* field);
  int Count(const char* field, int least, int most);
  bool HasNumber();  // whether anything but blanks and commas is left

  // The next line as one number, a comma or point before its decimals; an empty one is `if_empty`.
  double LineNumber(const char* field);
  double LineNumber(const char* field, double if_empty);
  int LineCount(const char* field, int least, int most);

  // Names the line that was read last.
  [[noreturn]] void Fail(const std::string& problem) const;

 private:
  double Parse(std::string_view text, const char* field) const;
  int Whole(double value, const char* field, int least, int most) const;
  bool SkipSeparators();

  std::string file_;
  std::vector<std::string_view> lines_;
  std::size_t next_ = 0, column_ = 0;  // where to go on
  std::size_t taken_ = 0;              // line that was read last, from 1
};

}  // namespace luxfield::formats
