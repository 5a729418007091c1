#include "luxfield/view/scene_file/toml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "luxfield/core/error.h"

namespace luxfield::view {
namespace {

toml::table Parse(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw InputError(file, fmt::format("is no valid TOML: {}", error.description()));
  }
}

// Of tables that have headers of their own, below `node` and without `without`.
void CollectHeaders(const toml::node& node, const toml::table& without,
                    std::vector<toml::source_position>& headers) {
  if (const toml::table* table = node.as_table()) {
    if (table == &without || table->is_inline()) return;
    headers.push_back(table->source().begin);
    for (const auto& [key, value] : *table) CollectHeaders(value, without, headers);
  } else if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) CollectHeaders(element, without, headers);
  }
}

}  // namespace

TomlText::TomlText(std::string text, const std::string& file)
    : text_(std::move(text)), root_(Parse(text_, file)) {}

std::vector<const toml::table*> TomlText::Tables(std::string_view key) const {
  std::vector<const toml::table*> tables;
  if (const toml::array* array = root_[key].as_array())
    for (const toml::node& node : *array)
      if (const toml::table* table = node.as_table()) tables.push_back(table);
  return tables;
}

// The parser counts lines and columns from 1, columns in characters.
std::size_t TomlText::ByteAt(toml::source_position place) const {
  std::size_t at = 0;
  for (toml::source_index line = 1; line < place.line; ++line) at = text_.find('\n', at) + 1;
  for (toml::source_index column = 1; column < place.column && at < text_.size(); ++column) {
    ++at;
    while (at < text_.size() && (static_cast<unsigned char>(text_[at]) & 0xC0) == 0x80) ++at;
  }
  return at;
}

std::size_t TomlText::LineBegin(std::size_t at) const {
  if (at == 0) return 0;
  const std::size_t feed = text_.rfind('\n', at - 1);
  return feed == std::string::npos ? 0 : feed + 1;
}

std::size_t TomlText::LineEnd(std::size_t at) const {
  const std::size_t feed = text_.find('\n', at);
  return feed == std::string::npos ? text_.size() : feed + 1;
}

void TomlText::Set(const toml::table& table, std::string_view key, const std::string& value,
                   std::string_view after) {
  if (const toml::node* node = table.get(key)) {
    const std::size_t begin = ByteAt(node->source().begin), end = ByteAt(node->source().end);
    edits_.push_back({begin, end - begin, value});
    return;
  }
  const std::size_t below = LineEnd(ByteAt(table.get(after)->source().end));
  const bool feeds = below > 0 && text_[below - 1] == '\n';
  edits_.push_back({below, 0, fmt::format("{}{} = {}\n", feeds ? "" : "\n", key, value)});
}

void TomlText::Drop(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (!node) return;
  const std::size_t begin = LineBegin(ByteAt(node->source().begin));
  edits_.push_back({begin, LineEnd(ByteAt(node->source().end)) - begin, ""});
}

void TomlText::DropTable(const toml::table& table) {
  std::vector<toml::source_position> headers;
  for (const auto& [key, value] : root_) CollectHeaders(value, table, headers);
  const std::size_t begin = LineBegin(ByteAt(table.source().begin));
  std::size_t end = text_.size();
  for (const auto& header : headers)
    if (const std::size_t at = LineBegin(ByteAt(header)); at > begin) end = std::min(end, at);
  // Comments stand above what they speak of.
  for (std::size_t line = end; line > begin && end < text_.size();) {
    line = LineBegin(line - 1);
    const std::size_t first = text_.find_first_not_of(" \t\r", line);
    if (first == std::string::npos || text_[first] != '#' || line <= begin) break;
    end = line;
  }
  edits_.push_back({begin, end - begin, ""});
}

std::string TomlText::Text() const {
  std::vector<Edit> edits = edits_;
  std::ranges::stable_sort(edits, {}, &Edit::at);
  std::string out;
  std::size_t at = 0;
  for (const Edit& edit : edits) {
    out += text_.substr(at, edit.at - at);
    out += edit.text;
    at = edit.at + edit.length;
  }
  out += text_.substr(at);
  if (appended_.empty()) return out;
  if (!out.empty() && out.back() != '\n') out += '\n';
  return out + appended_;
}

std::string TomlNumber(double value) { return fmt::format("{}", value); }

std::string TomlString(const std::string& text) {
  std::ostringstream out;
  const toml::value<std::string> value(text);
  out << toml::toml_formatter(
      value, toml::toml_formatter::default_flags & ~toml::format_flags::allow_literal_strings);
  return out.str();
}

}  // namespace luxfield::view
