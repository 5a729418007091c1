// luxfield bench classical
#include "luxfield/bench/verbs/verb_bench_classical.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "luxfield/bench/bench_classical.h"
#include "luxfield/cli/svg/svg_plot.h"
#include "luxfield/core/file.h"

namespace luxfield::bench {
namespace {

cli::Plot ErrorPlot(const core::Json& rows, const std::string& lamp) {
  cli::Plot plot;
  plot.title = fmt::format("{} by its photometric file", lamp);
  plot.x_label = "distance, m";
  plot.y_label = "error of illuminance, %";
  plot.log_x = plot.log_y = true;
  int style = 0;
  for (const std::string model : {"point", "linear", "area"}) {
    cli::Series open, edge;
    open.name = model;
    edge.name = model + ", behind an edge";
    open.style = edge.style = style++;
    edge.dashed = true;
    for (const auto& row : rows) {
      if (row.at("lamp") != lamp || row.at("model") != model) continue;
      for (auto* series : {&open, &edge}) series->x.push_back(row.at("distance_m"));
      open.y.push_back(100 * row.at("illuminance_error").get<double>());
      edge.y.push_back(100 * row.at("edge_error").get<double>());
    }
    plot.series.push_back(open);
    plot.series.push_back(edge);
  }
  return plot;
}

std::string From(const core::Json& distance_m) {
  return distance_m.is_null() ? "never" : fmt::format("{:.3g} m", distance_m.get<double>());
}

void Print(const core::Json& row) {
  const double percent = 100 * row.at("error").get<double>();
  fmt::print("{:>6} {:>7} {:>6.3g} % {:>12} {:>12}\n", row.value("lamp", ""),
             row.value("model", ""), percent, From(row.at("illuminance_m")),
             From(row.at("edge_m")));
}

core::Json Run(const BenchClassicalOptions& options, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  core::Json result = BenchClassical(options);
  fmt::print("{:>6} {:>7} {:>8} {:>12} {:>12}\n", "lamp", "model", "good for", "from", "with edge");
  std::vector<std::string> lamps;
  for (const auto& row : result.at("good_from")) {
    Print(row);
    const std::string lamp = row.at("lamp");
    if (lamps.empty() || lamps.back() != lamp) lamps.push_back(lamp);
  }
  for (const auto& lamp : lamps) {
    const auto file = folder / (lamp + ".svg");
    core::WriteFileAtomically(file, cli::SvgPlot(ErrorPlot(result.at("rows"), lamp)));
    fmt::print("{}\n", file.string());
  }
  return result;
}

}  // namespace

void AddBenchClassical(cli::Program& program, CLI::App& benches) {
  auto options = std::make_shared<BenchClassicalOptions>();
  auto folder = std::make_shared<std::filesystem::path>("out/classical");
  CLI::App& verb = program.AddVerb(
      benches, "classical",
      "From which distance on a lamp's photometric file is good enough as a point, line or area",
      [options, folder] { return Run(*options, *folder); });
  verb.add_option("--lamp", options->lamps, "Light fields (default: those of `./run lamps`)")
      ->default_str("");
  verb.add_option("--nearest", options->nearest_m, "Distance, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb.add_option("--farthest", options->farthest_m, "Distance, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb.add_option("--per-decade", options->per_decade, "Distances")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  verb.add_option("--receivers", options->receivers, "Along each side of the lit plane")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  verb.add_option("--folder", *folder, "Where plots go")->capture_default_str();
}

}  // namespace luxfield::bench
