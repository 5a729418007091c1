#include "luxfield/cli/reports/csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string_view>
#include <vector>

#include "luxfield/core/printable.h"

namespace luxfield::cli {
namespace {

std::string Quoted(const std::string& field) {
  if (field.find_first_of(",\"\n") == std::string::npos) return field;
  std::string quoted = "\"";
  for (const char c : field) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::string Csv(const core::Json& rows) {
  if (rows.empty()) return {};
  std::vector<std::string> keys;
  for (const auto& [key, value] : rows.front().items()) keys.push_back(key);
  std::string text = fmt::format("{}\n", fmt::join(keys, ","));
  for (const auto& row : rows) {
    std::vector<std::string> fields;
    for (const auto& [key, value] : row.items())
      fields.push_back(value.is_string() ? CsvText(value.get<std::string>())
                                         : Quoted(value.dump()));
    text += fmt::format("{}\n", fmt::join(fields, ","));
  }
  return text;
}

std::string CsvText(const std::string& text) {
  constexpr std::string_view kEvaluated = "=+-@\t";
  const std::string shown = core::Visible(text);
  const bool evaluated = !shown.empty() && kEvaluated.find(shown[0]) != kEvaluated.npos;
  return Quoted(evaluated ? "'" + shown : shown);
}

}  // namespace luxfield::cli
