#include "luxfield/bench/verbs/tradeoff_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "luxfield/cli/reports/csv.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::bench {
namespace {

// Rows of one scene, one kind of shadows and one surface.
cli::Plot TradeoffPlot(const std::vector<const core::Json*>& rows,
                       const std::vector<std::string>& estimators) {
  const core::Json& first = *rows.front();
  cli::Plot plot;
  plot.title = fmt::format("{}, {}, shadows: {}, {} x {}", first.value("scene", ""),
                           first.value("surface", ""), first.value("shadows", ""),
                           first.value("width", 0), first.value("height", 0));
  plot.x_label = "core-seconds of lighting, per picture";
  plot.y_label = "relative RMSE";
  plot.log_x = plot.log_y = true;
  plot.width = 720;
  plot.height = 460;
  cli::Series front{
      .name = "Pareto front", .x = {}, .y = {}, .lines = false, .style = {}, .ring = true};
  std::map<std::pair<int, std::string>, cli::Series> series;  // by estimator and knobs
  for (const core::Json* row : rows) {
    const std::string name = row->value("estimator", "");
    const auto style = static_cast<int>(std::find(estimators.begin(), estimators.end(), name) -
                                        estimators.begin());
    cli::Series& s = series[{style, row->value("knobs", "")}];
    s.style = style;
    s.x.push_back(row->value("core_s", 0.0));
    s.y.push_back(row->value("rel_rmse", 0.0));
    if (row->value("pareto", false)) {
      front.x.push_back(s.x.back());
      front.y.push_back(s.y.back());
    }
  }
  int named = -1;
  for (auto& [key, s] : series) {
    if (key.first != named) s.name = estimators[named = key.first];
    plot.series.push_back(std::move(s));
  }
  plot.series.push_back(std::move(front));
  return plot;
}

}  // namespace

std::vector<std::filesystem::path> WriteTradeoff(const core::Json& rows,
                                                 const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::vector<std::filesystem::path> files{folder / "tradeoff.csv"};
  core::WriteFileAtomically(files.back(), cli::Csv(rows));
  std::map<std::string, std::vector<const core::Json*>> plots;
  std::vector<std::string> estimators;  // of all plots: a colour means the same in each
  for (const auto& row : rows) {
    plots[fmt::format("{}-shadows-{}-{}.svg", row.value("scene", ""), row.value("shadows", ""),
                      row.value("surface", ""))]
        .push_back(&row);
    const std::string name = row.value("estimator", "");
    if (std::find(estimators.begin(), estimators.end(), name) == estimators.end())
      estimators.push_back(name);
  }
  for (const auto& [name, of_plot] : plots) {
    files.push_back(folder / name);
    core::WriteFileAtomically(files.back(), cli::SvgPlot(TradeoffPlot(of_plot, estimators)));
  }
  return files;
}

}  // namespace luxfield::bench
