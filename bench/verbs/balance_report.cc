#include "luxfield/bench/verbs/balance_report.h"

#include <map>
#include <string>

#include "luxfield/cli/reports/csv.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::bench {
namespace {

cli::Plot EfficiencyPlot(const core::Json& rows) {
  cli::Plot plot;
  plot.title = "Efficiency 1 / (relative variance x time) over that of the balance heuristic";
  plot.x_label = "scene";
  plot.y_label = "relative efficiency";
  plot.log_y = true;
  plot.width = 860;
  plot.height = 460;
  std::vector<std::string> scenes;
  std::map<std::string, std::size_t> strategies;
  for (const auto& row : rows) {
    if (scenes.empty() || scenes.back() != row.value("scene", ""))
      scenes.push_back(row.value("scene", ""));
    const auto [strategy, is_new] =
        strategies.emplace(row.value("strategy", ""), plot.series.size());
    if (is_new)
      plot.series.push_back(
          {.name = strategy->first, .x = {}, .y = {}, .lines = false, .style = {}});
    cli::Series& series = plot.series[strategy->second];
    series.x.push_back(static_cast<double>(scenes.size()));
    series.y.push_back(row.value("rel_efficiency", 0.0));
  }
  for (std::size_t k = 0; k < scenes.size(); ++k)
    plot.x_label += (k ? ", " : ": ") + std::to_string(k + 1) + " " + scenes[k];
  return plot;
}

}  // namespace

std::vector<std::filesystem::path> WriteBalance(const core::Json& result,
                                                const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::vector<std::filesystem::path> files;
  const auto write = [&](const char* name, const std::string& text) {
    files.push_back(folder / name);
    core::WriteFileAtomically(files.back(), text);
  };
  write("balance.csv", cli::Csv(result["rows"]));
  if (!result["search"].empty()) write("search.csv", cli::Csv(result["search"]));
  write("claims.csv", cli::Csv(result["claims"]));
  write("steps.csv", cli::Csv(result["steps"]));
  write("balance.svg", cli::SvgPlot(EfficiencyPlot(result["rows"])));
  return files;
}

}  // namespace luxfield::bench
