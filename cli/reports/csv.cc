#include "luxfield/cli/reports/csv.h"

namespace luxfield::cli {

std::string Csv(const core::Json& rows) {
  std::string text;
  const auto cell = [](const core::Json& value) {
    return CsvCell(value.is_string() ? value.get<std::string>() : value.dump());
  };
  if (rows.empty()) return text;
  for (const auto& [key, value] : rows.front().items()) text += (text.empty() ? "" : ",") + key;
  for (const auto& row : rows) {
    std::string line;
    for (const auto& [key, value] : row.items()) line += (line.empty() ? "" : ",") + cell(value);
    text += "\n" + line;
  }
  return text + "\n";
}

std::string CsvCell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace luxfield::cli
