#include "luxfield/cli/table_columns.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace luxfield::cli {
namespace {

bool IsNumber(const std::string& cell) {
  if (cell.find(',') != std::string::npos) return false;
  if (cell[0] == '-' || cell[0] == '+' || cell[0] == '<' || cell[0] == '>') return true;
  if (!std::isdigit(static_cast<unsigned char>(cell[0]))) return false;
  char* end = nullptr;
  std::strtod(cell.c_str(), &end);
  return !std::isalpha(static_cast<unsigned char>(*end));
}

}  // namespace

std::vector<bool> NumberColumns(const std::vector<std::vector<std::string>>& rows) {
  std::size_t count = 0;
  for (const auto& row : rows) count = std::max(count, row.size());
  std::vector<bool> columns(count);
  for (std::size_t k = 0; k < count; ++k) {
    int numbers = 0, filled = 0;
    for (std::size_t r = 1; r < rows.size(); ++r) {
      if (k >= rows[r].size() || rows[r][k].empty()) continue;
      ++filled;
      numbers += IsNumber(rows[r][k]);
    }
    columns[k] = 2 * numbers > filled;
  }
  return columns;
}

}  // namespace luxfield::cli
