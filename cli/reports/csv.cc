#include "luxfield/cli/reports/csv.h"

namespace luxfield::cli {

std::string Csv(const core::Json& rows) {
  std::string text;
  const auto cell = [](const core::Json& value) {
    const std::string plain = value.is_string() ? value.get<std::string>() : value.dump();
    if (plain.find_first_of(",\"\n") == std::string::npos) return plain;
    std::string quoted = "\"";
    for (const char c : plain) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
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

}  // namespace luxfield::cli
