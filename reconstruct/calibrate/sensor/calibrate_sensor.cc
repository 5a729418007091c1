#include "luxfield/reconstruct/calibrate/sensor/calibrate_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/rig/cfa.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"
#include "luxfield/version.h"

namespace luxfield::reconstruct {
namespace {

using session::FrameKind;
using session::FrameRecord;
using session::RawFrame;
using Pixels = std::vector<std::pair<int, int>>;

constexpr double kLargestOutlierShare = 0.01;

// Frames of a pair by site; PixelMask of each.
using SitePair = std::pair<std::vector<RawFrame>, std::vector<RawFrame>>;
using SiteMasks = std::vector<PixelMask>;

SitePair ReadSites(const CalibrationPair& pair, const std::string& cfa) {
  auto [a, b] = pair.read();
  return {SplitSites(std::move(a), cfa), SplitSites(std::move(b), cfa)};
}

// What stands out of its neighbours of the same site, as the sensor's pixels; out of the masks.
Pixels MaskOutliers(const SitePair& frames, const std::vector<int>& sites, const std::string& cfa,
                    const char* what, SiteMasks& masks) {
  Pixels found;
  for (const int site : sites) {
    const RawFrame &a = frames.first[site], &b = frames.second[site];
    const Pixels outliers = FindOutliers(a, b);
    const double share = static_cast<double>(outliers.size()) / static_cast<double>(a.size());
    if (share > kLargestOutlierShare)
      throw InputError(fmt::format(
          "{:.2g} % of the pixels stand out of their neighbours in the {}; light the sensor evenly "
          "for flats, shut all light out for darks",
          100 * share, what));
    for (const auto& [row, column] : outliers) {
      std::uint8_t& counts = masks[site][static_cast<std::size_t>(row) * a.width + column];
      if (counts) found.push_back(PixelOfSite(cfa, site, row, column));
      counts = 0;
    }
  }
  return found;
}

// Of every pair its sites' statistics, whose channel is the pair's or, of a mosaic, the site.
std::vector<PairStatistics> MeasureAll(std::span<const CalibrationPair> pairs,
                                       const std::string& cfa, const SiteMasks& masks) {
  std::vector<PairStatistics> result;
  core::Progress progress("measure", pairs.size());
  for (const CalibrationPair& pair : pairs) {
    core::ThrowIfInterrupted();
    const auto [a, b] = ReadSites(pair, cfa);
    for (int site = 0; site < SitesOf(cfa); ++site) {
      PairStatistics statistics = MeasurePair(a[site], b[site], masks[site]);
      statistics.dark = pair.dark;
      statistics.channel = cfa.empty() ? pair.channel : site;
      statistics.exposure_s = pair.exposure_s;
      statistics.meter_a = pair.meter_a;
      statistics.meter_b = pair.meter_b;
      result.push_back(statistics);
    }
    progress.Advance();
  }
  return result;
}

// Fits all statistics; of a mosaic once more without the flats at which another site is saturated.
PhotonTransfer FitAll(std::vector<PairStatistics>& statistics, const std::string& cfa) {
  PhotonTransfer transfer = FitPhotonTransfer(statistics);
  if (cfa.empty()) return transfer;
  double saturates_s = std::numeric_limits<double>::infinity();
  for (const TransferPoint& point : transfer.points)
    if (point.saturated) saturates_s = std::min(saturates_s, point.exposure_s);
  bool overflown = false;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    PairStatistics& pair = statistics[k];
    pair.overflown = !pair.dark && pair.exposure_s >= saturates_s && !transfer.points[k].saturated;
    overflown = overflown || pair.overflown;
  }
  return overflown ? FitPhotonTransfer(statistics) : transfer;
}

// The pair of flats with the most light below saturation, by its channel's statistics.
const CalibrationPair* BrightestBelowSaturation(std::span<const CalibrationPair> pairs,
                                                std::span<const PairStatistics> statistics,
                                                const PhotonTransfer& transfer, int channel) {
  const std::size_t sites = statistics.size() / pairs.size();
  const CalibrationPair* best = nullptr;
  double brightest = 0;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    const PairStatistics& s = statistics[k];
    if (s.dark || s.channel != channel || transfer.points[k].saturated) continue;
    if (best && s.mean() <= brightest) continue;
    best = &pairs[k / sites];
    brightest = s.mean();
  }
  return best;
}

const CalibrationPair& DarkNearest(std::span<const CalibrationPair> pairs, double exposure_s) {
  const CalibrationPair* best = nullptr;
  for (const CalibrationPair& pair : pairs)
    if (pair.dark && (!best || std::abs(std::log(pair.exposure_s / exposure_s)) <
                                   std::abs(std::log(best->exposure_s / exposure_s))))
      best = &pair;
  return *best;
}

// Only the pairs of a channel, and all darks.
std::vector<PairStatistics> OfChannel(std::span<const PairStatistics> all, int channel) {
  std::vector<PairStatistics> result;
  for (const PairStatistics& pair : all)
    if (pair.dark || pair.channel == channel) result.push_back(pair);
  return result;
}

// One channel, or one site of a mosaic.
ChannelCalibration CalibrateChannel(std::span<const CalibrationPair> pairs,
                                    std::span<const PairStatistics> statistics,
                                    const PhotonTransfer& of_all, int channel,
                                    const std::string& cfa, const SiteMasks& masks) {
  ChannelCalibration c;
  c.channel = channel;
  const int site = cfa.empty() ? 0 : channel;
  if (!cfa.empty()) {
    c.channel = rig::CfaChannel(cfa, site / 2, site % 2);
    c.site = site;
  }
  const std::vector<PairStatistics> own = OfChannel(statistics, channel);
  c.transfer = FitPhotonTransfer(own);
  c.linearity = MeasureLinearity(own, c.transfer, channel);
  const auto* flat = BrightestBelowSaturation(pairs, statistics, of_all, channel);
  const SitePair flats = ReadSites(*flat, cfa),
                 darks = ReadSites(DarkNearest(pairs, flat->exposure_s), cfa);
  const PatternVariance prnu = MeasurePrnuSquared(
      flats.first[site], flats.second[site], darks.first[site], darks.second[site], masks[site]);
  c.prnu_squared = {prnu.value, prnu.sigma};
  c.prnu = RootOf(c.prnu_squared);
  return c;
}

}  // namespace

std::vector<CalibrationPair> PairsOfSession(const session::SessionReader& session,
                                            bool check_hashes) {
  std::map<std::tuple<bool, int, int, int>, std::vector<const FrameRecord*>> groups;
  for (const FrameRecord& record : session.frames())
    if (record.kind == FrameKind::kFlat || record.kind == FrameKind::kDark)
      groups[{record.kind == FrameKind::kDark, record.channel, record.exposure_index,
              record.repeat / 2}]
          .push_back(&record);
  std::vector<CalibrationPair> pairs;
  int darks = 0;
  for (const auto& [key, records] : groups) {
    if (records.size() < 2) continue;
    const FrameRecord &a = *records[0], &b = *records[1];
    if (a.exposure_s != b.exposure_s)
      throw InputError((session.folder() / "journal.jsonl").string(),
                       fmt::format("'{}' and '{}' are a pair with exposures of {} s and {} s",
                                   a.file, b.file, a.exposure_s, b.exposure_s),
                       "capture again with exposures that the camera keeps");
    pairs.push_back({std::get<0>(key), std::get<1>(key), a.exposure_s, a.meter, b.meter,
                     [&session, first = &a, second = &b, check_hashes] {
                       return std::pair(session.ReadFrame(*first, check_hashes),
                                        session.ReadFrame(*second, check_hashes));
                     }});
    darks += std::get<0>(key);
  }
  if (darks == 0 || darks == static_cast<int>(pairs.size()))
    throw InputError(session.folder().string(),
                     fmt::format("holds {} pairs of darks and {} of flats", darks,
                                 static_cast<int>(pairs.size()) - darks),
                     "capture a plan of kind \"sensor\"");
  return pairs;
}

SensorCalibration CalibrateSensor(std::span<const CalibrationPair> pairs, const std::string& cfa) {
  const CalibrationPair* longest_dark = nullptr;
  std::set<int> channels;  // of a mosaic: sites
  std::vector<int> sites;
  for (int site = 0; site < SitesOf(cfa); ++site) sites.push_back(site);
  for (const CalibrationPair& pair : pairs) {
    if (!pair.dark) channels.insert(pair.channel);
    if (pair.dark && (!longest_dark || pair.exposure_s > longest_dark->exposure_s))
      longest_dark = &pair;
  }
  if (!cfa.empty()) channels = {sites.begin(), sites.end()};
  if (!longest_dark)
    throw InputError("no dark frames; a sensor is calibrated from flats and darks");
  SensorCalibration result;
  SiteMasks masks;
  {
    auto [a, b] = longest_dark->read();
    result.width = a.width;
    result.height = a.height;
    if (!a.value.empty()) result.bits = 32;
    const SitePair darks{SplitSites(std::move(a), cfa), SplitSites(std::move(b), cfa)};
    for (const RawFrame& frame : darks.first) masks.emplace_back(frame.size(), 1);
    result.hot = MaskOutliers(darks, sites, cfa, "darks", masks);
  }
  std::sort(result.hot.begin(), result.hot.end());
  std::vector<PairStatistics> statistics = MeasureAll(pairs, cfa, masks);
  result.transfer = FitAll(statistics, cfa);
  for (const int channel : channels) {
    const auto* flat = BrightestBelowSaturation(pairs, statistics, result.transfer, channel);
    if (!flat) continue;
    const int site = cfa.empty() ? 0 : channel;
    const Pixels dead = MaskOutliers(ReadSites(*flat, cfa), {site}, cfa, "flats", masks);
    result.dead.insert(result.dead.end(), dead.begin(), dead.end());
  }
  std::sort(result.dead.begin(), result.dead.end());
  if (!result.dead.empty()) {
    statistics = MeasureAll(pairs, cfa, masks);
    result.transfer = FitAll(statistics, cfa);
  }
  for (const int channel : channels) {
    ChannelCalibration c =
        CalibrateChannel(pairs, statistics, result.transfer, channel, cfa, masks);
    const auto n = static_cast<double>(channels.size());
    result.prnu_squared.value += c.prnu_squared.value / n;
    // A mosaic's sites are different pixels. Channels of a wheel are seen by the same ones: their
    // errors need not be independent.
    const double sigma = c.prnu_squared.sigma / n;
    result.prnu_squared.sigma = cfa.empty() ? result.prnu_squared.sigma + sigma
                                            : std::hypot(result.prnu_squared.sigma, sigma);
    result.channels.push_back(std::move(c));
  }
  result.prnu = RootOf(result.prnu_squared);
  return result;
}

SensorCalibration CalibrateSensor(const session::SessionReader& session, bool check_hashes) {
  const std::string file = (session.folder() / "session.json").string();
  const session::SessionCamera camera =
      session::Stated(session::SetupOf(session).camera, "camera", file);
  const std::vector<CalibrationPair> pairs = PairsOfSession(session, check_hashes);
  SensorCalibration result;
  try {
    result = CalibrateSensor(pairs, camera.cfa);
  } catch (const InputError& error) {
    // What frames show knows no file; frames that cannot be read have named theirs.
    const std::string folder = session.folder().string(), what = error.what();
    if (what.starts_with(folder)) throw;
    throw InputError(fmt::format("{}: {}", folder, what));
  }
  result.bits = session::Stated(camera.bits, "bits", file);
  std::string hashes;
  for (const FrameRecord& record : session.frames()) hashes += record.sha256;
  result.provenance = {{"session_plan", session.plan_id()},
                       {"frames_sha256", core::Sha256(hashes)},
                       {"software", "luxfield " LUXFIELD_VERSION}};
  return result;
}

}  // namespace luxfield::reconstruct
