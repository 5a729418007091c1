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

constexpr int kFewSamples = 4, kFewRuns = 2;
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

Runs RunSome(const PeersOptions& options, const std::string& renderer, const fs::path& folder,
             int spp, int count, core::Progress& progress) {
  Runs runs;
  for (int run = 0; run < count; ++run) {
    core::ThrowIfInterrupted();
    const auto seed = options.seed + static_cast<std::uint64_t>(run);
    runs.core_s.push_back(RunProcess(Render(options, renderer, folder, spp, seed), folder).core_s);
    runs.pictures.push_back(core::LuminanceImage(core::ReadExrImage(folder / "picture.exr")));
    progress.Advance();
  }
  return runs;
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

PeerFigures Measure(const PeersOptions& options, const std::string& renderer,
                    const fs::path& folder, core::Progress& progress) {
  PeerFigures figures;
  const Runs few = RunSome(options, renderer, folder, kFewSamples, kFewRuns, progress);
  figures.few = kFewSamples;
  figures.few_core_s = core::Median(few.core_s);
  figures.spp = SamplesFor(options.error, RootMeanSquare(ErrorsAmong(few.pictures)), kFewSamples);
  const Runs runs = RunSome(options, renderer, folder, figures.spp, options.runs, progress);
  figures.core_s = core::Median(runs.core_s);
  figures.rel_rmse = RootMeanSquare(ErrorsAmong(runs.pictures));
  StateMean(runs.pictures, figures);
  return figures;
}

json RowOf(const PeerFigures& figures, const PeerFigures& ours, double error) {
  const PeerCost cost = CostAtError(figures, error), our_cost = CostAtError(ours, error);
  json row{{"spp", figures.spp},
           {"rel_rmse", figures.rel_rmse},
           {"mean", figures.mean},
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
  std::vector<Peer> peers{{"cycles", {}}, {"mitsuba", {}}};
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
  const PeerFigures ours = Measure(options, kOurs, folder, progress);
  json rows{RowOf(ours, ours, options.error)};
  rows[0].update({{"scene", scene}, {"renderer", kOurs}});
  for (const Peer& peer : peers) {
    const std::string missing =
        peer.missing.empty() ? refused.value(peer.name, std::string()) : peer.missing;
    json row;
    if (missing.empty())
      row = RowOf(Measure(options, peer.name, folder, progress), ours, options.error);
    else
      row["missing"] = missing;
    if (!missing.empty()) progress.Advance(static_cast<std::uint64_t>(options.runs) + kFewRuns);
    row.update({{"scene", scene}, {"renderer", peer.name}});
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

PeerCost CostAtError(const PeerFigures& figures, double error) {
  PeerCost cost;
  cost.sample_core_s =
      std::max(0.0, (figures.core_s - figures.few_core_s) / (figures.spp - figures.few));
  cost.fixed_core_s = figures.few_core_s - figures.few * cost.sample_core_s;
  const double samples = figures.spp * std::pow(figures.rel_rmse / error, 2);
  cost.light_core_s = cost.sample_core_s * std::max(1.0, samples);
  cost.whole_core_s = cost.fixed_core_s + cost.light_core_s;
  return cost;
}

int SamplesFor(double error, double few_rel_rmse, int few) {
  constexpr int kLeast = 16, kMost = 256;
  const double samples = few * std::pow(few_rel_rmse / error, 2);
  int spp = kLeast;
  while (spp < kMost && 2 * spp < samples) spp *= 4;
  return spp;
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
  core::Progress progress("pictures", scenes.size() * (peers.size() + 1) *
                                          (static_cast<std::uint64_t>(options.runs) + kFewRuns));
  json rows = json::array();
  for (const std::string& scene : scenes)
    for (const json& row : MeasureScene(options, scene, peers, progress)) rows.push_back(row);
  return rows;
}

}  // namespace luxfield::bench
