#include "luxfield/formats/text_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/core/range.h"

namespace luxfield::formats {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f\x1a";  // with the end-of-file mark of DOS
constexpr std::string_view kSeparators = " ,\t\r\v\f\x1a";

// Length of the UTF-8 character at the beginning, 0 where there is none.
std::size_t CharacterLength(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((static_cast<unsigned char>(text[k]) & 0xC0) != 0x80) return 0;
  return length;
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = CharacterLength(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

}  // namespace

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string Utf8FromLatin1(std::string_view text) {
  if (IsUtf8(text)) return std::string(text);
  std::string out;
  for (const char byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (code < 0x80) {
      out += byte;
    } else {
      out += static_cast<char>(0xC0 | (code >> 6));
      out += static_cast<char>(0x80 | (code & 0x3F));
    }
  }
  return out;
}

TextReader::TextReader(std::string_view text, std::string file) : file_(std::move(file)) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    // Lines end with LF, CR LF or CR.
    const auto end = text.find_first_of("\r\n");
    lines_.push_back(text.substr(0, end));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + (text.substr(end, 2) == "\r\n" ? 2 : 1));
  }
}

void TextReader::Fail(const std::string& problem) const {
  throw InputError(file_, fmt::format("line {}: {}", taken_, problem), "have it exported anew");
}

std::string TextReader::Line(const char* field) {
  if (AtEnd())
    throw InputError(file_, fmt::format("ends at line {}, before its {}", lines_.size(), field),
                     "the file is truncated: copy it again");
  column_ = 0;
  taken_ = next_ + 1;
  return Utf8FromLatin1(Trimmed(lines_[next_++]));
}

double TextReader::Parse(std::string_view text, const char* field) const {
  std::string_view digits = text;
  if (digits.starts_with("+") && !digits.starts_with("+-")) digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !core::Range{}.Holds(value))
    Fail(fmt::format("{} '{}' is no number", field, core::Printable(text)));
  return value;
}

int TextReader::Whole(double value, const char* field, int least, int most) const {
  if (!(value >= least && value <= most) || value != std::floor(value))
    Fail(fmt::format("{} = {:g} is no whole number from {} to {}", field, value, least, most));
  return static_cast<int>(value);
}

bool TextReader::SkipSeparators() {
  for (; next_ < lines_.size(); ++next_, column_ = 0) {
    column_ = lines_[next_].find_first_not_of(kSeparators, column_);
    if (column_ != std::string_view::npos) return true;
  }
  column_ = 0;
  return false;
}

bool TextReader::HasNumber() { return SkipSeparators(); }

double TextReader::Number(const char* field) {
  if (!SkipSeparators())
    throw InputError(file_, fmt::format("ends at line {}, before its {}", lines_.size(), field),
                     "the file is truncated: copy it again");
  const std::string_view line = lines_[next_];
  const std::size_t end = std::min(line.find_first_of(kSeparators, column_), line.size());
  const std::string_view text = line.substr(column_, end - column_);
  column_ = end;
  taken_ = next_ + 1;
  return Parse(text, field);
}

int TextReader::Count(const char* field, int least, int most) {
  return Whole(Number(field), field, least, most);
}

double TextReader::LineNumber(const char* field) {
  std::string line = Line(field);
  if (const auto comma = line.find(','); comma != std::string::npos) line[comma] = '.';
  return Parse(line, field);
}

double TextReader::LineNumber(const char* field, double if_empty) {
  if (!AtEnd() && Trimmed(lines_[next_]).empty()) {
    Line(field);
    return if_empty;
  }
  return LineNumber(field);
}

int TextReader::LineCount(const char* field, int least, int most) {
  return Whole(LineNumber(field), field, least, most);
}

}  // namespace luxfield::formats
