#include "luxfield/bench/verbs/bench_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "luxfield/core/file.h"
#include "luxfield/core/parallel.h"

namespace luxfield::bench {

void PrintRows(const core::Json& rows, const std::vector<std::string>& columns) {
  if (rows.empty()) return;
  std::vector<std::vector<std::string>> cells{columns};
  if (columns.empty())
    for (const auto& [key, value] : rows.front().items())
      if (!value.is_structured()) cells[0].push_back(key);
  for (const auto& row : rows) {
    cells.emplace_back();
    for (const auto& key : cells[0]) {
      const auto it = row.find(key);
      if (it == row.end())
        cells.back().emplace_back("");
      else if (it->is_number_float())
        cells.back().push_back(fmt::format("{:.4g}", it->get<double>()));
      else
        cells.back().push_back(it->is_string() ? it->get<std::string>() : it->dump());
    }
  }
  for (const auto& row : cells) {
    for (std::size_t column = 0; column < row.size(); ++column) {
      std::size_t width = 0;
      for (const auto& other : cells) width = std::max(width, other[column].size());
      fmt::print("{}{:<{}}", column ? "  " : "", row[column], width);
    }
    fmt::print("\n");
  }
}

core::Json Finish(const core::Json& rows, const std::string& device,
                  const std::vector<std::string>& columns) {
  PrintRows(rows, columns);
  return {{"rows", rows}, {"device", device}, {"threads", core::Threads()}};
}

std::string CpuName() {
  std::istringstream lines(core::ReadFile("/proc/cpuinfo"));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown CPU";
}

}  // namespace luxfield::bench
