#include "luxfield/bench/peers/bench_peers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "luxfield/bench/all/bench_error_runs.h"
#include "luxfield/bench/all/process.h"
#include "luxfield/bench/peers/peer_scenes.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/measures.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kFewRuns = 2;  // of points that are passed
constexpr double kMeansAgree = 5e-4, kStandardErrors = 3;
const char* const kOurs = "luxfield";

std::vector<std::string> Python(const PeersOptions& options, const std::string& script) {
  return {"/usr/bin/env", options.python, fs::absolute(options.scripts / script)};
}

std::vector<std::string> Render(const PeersOptions& options, const std::string& renderer,
                                const fs::path& folder, int spp, std::uint64_t seed) {
  std::vector<std::string> words;
  if (renderer == kOurs)
    words = {LuxfieldProgram(),
             "render",
             folder / "scene.toml",
             "--width",
             std::to_string(options.width),
             "--height",
             std::to_string(options.height),
             "--quiet"};
  else
    words = Python(options, fmt::format("render_{}.py", renderer));
  if (renderer != kOurs) words.push_back(folder / "scene.json");
  words.insert(words.end(), {"-o", folder / "picture.exr", "--spp", std::to_string(spp), "--seed",
                             std::to_string(seed), "--threads", std::to_string(options.threads)});
  if (renderer == kOurs && !options.device.empty())
    words.insert(words.end(), {"--device", options.device});
  return words;
}

struct Runs {
  std::vector<double> core_s;
  std::vector<core::Image> pictures;  // luminance
};

// With seeds from options.seed + first on.
void RunSome(const PeersOptions& options, const std::string& renderer, const fs::path& folder,
             int spp, int first, int end, Runs& runs) {
  for (int run = first; run < end; ++run) {
    core::ThrowIfInterrupted();
    const auto seed = options.seed + static_cast<std::uint64_t>(run);
    runs.core_s.push_back(RunProcess(Render(options, renderer, folder, spp, seed), folder).core_s);
    runs.pictures.push_back(core::LuminanceImage(core::ReadExrImage(folder / "picture.exr")));
  }
}

double RootMeanSquare(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

void StateMean(const std::vector<core::Image>& pictures, PeerFigures& figures) {
  std::vector<double> means;
  for (const core::Image& picture : pictures) {
    double sum = 0;
    for (const float value : picture.data) sum += value;
    means.push_back(sum / static_cast<double>(picture.data.size()));
  }
  const auto n = static_cast<double>(means.size());
  for (const double mean : means) figures.mean += mean / n;
  double squares = 0;
  for (const double mean : means) squares += (mean - figures.mean) * (mean - figures.mean);
  figures.mean_se = std::sqrt(squares / (n - 1) / n);
}

PeerPoint PointOf(int spp, const Runs& runs) {
  return {spp, core::Median(runs.core_s), RootMeanSquare(ErrorsAmong(runs.pictures))};
}

PeerFigures Measure(const PeersOptions& options, const std::string& renderer,
                    const fs::path& folder) {
  PeerFigures figures;
  Runs runs;
  RunSome(options, renderer, folder, 1, 0, 1, runs);  // compiles kernels, reads files: not counted
  figures.points = MeasurePoints(options.error, [&](int spp) {
    runs = {};
    RunSome(options, renderer, folder, spp, 0, kFewRuns, runs);
    return PointOf(spp, runs);
  });
  PeerPoint& last = figures.points.back();
  RunSome(options, renderer, folder, last.spp, kFewRuns, options.runs, runs);
  last = PointOf(last.spp, runs);
  StateMean(runs.pictures, figures);
  return figures;
}

json RowOf(const PeerFigures& figures, const PeerFigures& ours, double error) {
  const PeerCost cost = CostAtError(figures, error), our_cost = CostAtError(ours, error);
  json row{{"spp", figures.points.back().spp},
           {"rel_rmse", figures.points.back().rel_rmse},
           {"mean", figures.mean},
           {"samples", cost.samples},
           {"sample_core_s", cost.sample_core_s},
           {"fixed_core_s", cost.fixed_core_s},
           {"light_core_s", cost.light_core_s},
           {"whole_core_s", cost.whole_core_s},
           {"whole_ratio", our_cost.whole_core_s / cost.whole_core_s}};
  if (cost.light_core_s > 0) row["light_ratio"] = our_cost.light_core_s / cost.light_core_s;
  row["mean_off"] = figures.mean / ours.mean - 1;
  row["mean_off_se"] = std::hypot(figures.mean_se, ours.mean_se) / ours.mean;
  row["agrees"] = MeansAgree(ours, figures);
  return row;
}

struct Peer {
  std::string name;
  std::string missing;  // empty: it is there
};

std::vector<Peer> FindPeers(const PeersOptions& options) {
  std::vector<Peer> peers{{"cycles", {}}, {"mitsuba", {}}, {"pbrt", {}}};
  for (Peer& peer : peers) {
    auto words = Python(options, fmt::format("render_{}.py", peer.name));
    core::RequireRegularFile(words.back());
    words.emplace_back("--version");
    try {
      RunProcess(words, options.folder);
    } catch (const DeviceError& error) {
      peer.missing = error.what();
    }
  }
  return peers;
}

json MeasureScene(const PeersOptions& options, const std::string& scene,
                  const std::vector<Peer>& peers, core::Progress& progress) {
  const fs::path folder = options.folder / "scene";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const fs::path file =
      WritePeerScene(scene, {folder, fs::absolute(options.distribution), options.triangles});
  std::vector<std::string> words{"/usr/bin/env", "python3",
                                 fs::absolute(options.scripts / "export.py")};
  words.insert(words.end(), {file, "-o", folder, "--width", std::to_string(options.width),
                             "--height", std::to_string(options.height)});
  RunProcess(words, folder);
  const json refused = json::parse(core::ReadFile(folder / "scene.json")).at("refused");
  const PeerFigures ours = Measure(options, kOurs, folder);
  progress.Advance();
  json rows{RowOf(ours, ours, options.error)};
  rows[0].update({{"scene", scene}, {"renderer", kOurs}});
  for (const Peer& peer : peers) {
    const std::string missing =
        peer.missing.empty() ? refused.value(peer.name, std::string()) : peer.missing;
    json row;
    if (missing.empty())
      row = RowOf(Measure(options, peer.name, folder), ours, options.error);
    else
      row["missing"] = missing;
    progress.Advance();
    row.update({{"scene", scene}, {"renderer", peer.name}});
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

double SamplesAtError(const std::vector<PeerPoint>& points, double error) {
  const auto as_root = [error](const PeerPoint& from) {
    return std::max(1.0, from.spp * std::pow(from.rel_rmse / error, 2));
  };
  if (error >= points.front().rel_rmse) return as_root(points.front());
  for (std::size_t k = 1; k < points.size(); ++k) {
    const PeerPoint &from = points[k - 1], &to = points[k];
    if (to.rel_rmse > error) continue;
    if (!(to.rel_rmse > 0)) return to.spp;
    const double share = std::log(from.rel_rmse / error) / std::log(from.rel_rmse / to.rel_rmse);
    return from.spp * std::pow(static_cast<double>(to.spp) / from.spp, share);
  }
  return as_root(points.back());
}

PeerCost CostAtError(const PeerFigures& figures, double error) {
  const PeerPoint &first = figures.points.front(), &last = figures.points.back();
  PeerCost cost;
  cost.samples = SamplesAtError(figures.points, error);
  cost.sample_core_s = std::max(0.0, (last.core_s - first.core_s) / (last.spp - first.spp));
  cost.fixed_core_s = first.core_s - first.spp * cost.sample_core_s;
  cost.light_core_s = cost.sample_core_s * cost.samples;
  cost.whole_core_s = cost.fixed_core_s + cost.light_core_s;
  return cost;
}

std::vector<PeerPoint> MeasurePoints(double error,
                                     const std::function<PeerPoint(int spp)>& measure) {
  constexpr int kFirst = 4, kMost = 256;
  std::vector<PeerPoint> points{measure(kFirst)};
  do {
    points.push_back(measure(4 * points.back().spp));
  } while (points.back().spp < kMost && points.back().rel_rmse > 2 * error);
  return points;
}

bool MeansAgree(const PeerFigures& ours, const PeerFigures& peer) {
  return std::abs(peer.mean - ours.mean) <=
         kMeansAgree * ours.mean + kStandardErrors * std::hypot(ours.mean_se, peer.mean_se);
}

json BenchPeers(const PeersOptions& options) {
  if (options.runs < 2)
    throw InputError("bench peers: --runs must be at least 2; errors are told by others");
  fs::create_directories(options.folder);
  const std::vector<Peer> peers = FindPeers(options);
  const std::vector<std::string>& scenes =
      options.scenes.empty() ? PeerSceneNames() : options.scenes;
  core::Progress progress("bench peers", scenes.size() * (peers.size() + 1));
  json rows = json::array();
  for (const std::string& scene : scenes)
    for (const json& row : MeasureScene(options, scene, peers, progress)) rows.push_back(row);
  return rows;
}

}  // namespace luxfield::bench
