#include "reconstruct/calibrate_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/error.h"
#include "core/file.h"
#include "core/json.h"
#include "core/progress.h"
#include "reconstruct/noise_model.h"

namespace luxfield::reconstruct {
namespace {

using core::FrameKind;
using core::FrameRecord;
using core::RawFrame;
using Pixels = std::vector<std::pair<int, int>>;

constexpr double kLargestOutlierShare = 0.01;

void Mask(const Pixels& pixels, int width, PixelMask& mask) {
  for (const auto& [row, column] : pixels) mask[static_cast<std::size_t>(row) * width + column] = 0;
}

void CheckShare(const Pixels& outliers, const RawFrame& frame, const char* what) {
  const double share = static_cast<double>(outliers.size()) / static_cast<double>(frame.size());
  if (share > kLargestOutlierShare)
    throw InputError(fmt::format(
        "{:.2g} % of the pixels stand out of their neighbours in the {}; light the sensor evenly "
        "for flats, shut all light out for darks",
        100 * share, what));
}

std::vector<PairStatistics> MeasureAll(std::span<const CalibrationPair> pairs,
                                       const PixelMask& mask) {
  std::vector<PairStatistics> result;
  core::Progress progress("measure", pairs.size());
  for (const CalibrationPair& pair : pairs) {
    core::ThrowIfInterrupted();
    const auto [a, b] = pair.read();
    PairStatistics statistics = MeasurePair(a, b, mask);
    statistics.dark = pair.dark;
    statistics.channel = pair.channel;
    statistics.exposure_s = pair.exposure_s;
    statistics.meter_a = pair.meter_a;
    statistics.meter_b = pair.meter_b;
    result.push_back(statistics);
    progress.Advance();
  }
  return result;
}

// The pair of flats with the most light below saturation.
const CalibrationPair* BrightestBelowSaturation(std::span<const CalibrationPair> pairs,
                                                std::span<const PairStatistics> statistics,
                                                const PhotonTransfer& transfer, int channel) {
  const CalibrationPair* best = nullptr;
  double brightest = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (pairs[k].dark || pairs[k].channel != channel || transfer.points[k].saturated) continue;
    if (best && statistics[k].mean() <= brightest) continue;
    best = &pairs[k];
    brightest = statistics[k].mean();
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

}  // namespace

std::vector<CalibrationPair> PairsOfSession(const core::SessionReader& session, bool check_hashes) {
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

SensorCalibration CalibrateSensor(std::span<const CalibrationPair> pairs) {
  const CalibrationPair* longest_dark = nullptr;
  std::set<int> channels;
  for (const CalibrationPair& pair : pairs) {
    if (!pair.dark) channels.insert(pair.channel);
    if (pair.dark && (!longest_dark || pair.exposure_s > longest_dark->exposure_s))
      longest_dark = &pair;
  }
  if (!longest_dark)
    throw InputError("no dark frames; a sensor is calibrated from flats and darks");
  SensorCalibration result;
  PixelMask mask;
  {
    const auto [a, b] = longest_dark->read();
    result.width = a.width;
    result.height = a.height;
    if (!a.value.empty()) result.bits = 32;
    result.hot = FindOutliers(a, b);
    CheckShare(result.hot, a, "darks");
    mask.assign(a.size(), 1);
    Mask(result.hot, a.width, mask);
  }
  std::vector<PairStatistics> statistics = MeasureAll(pairs, mask);
  result.transfer = FitPhotonTransfer(statistics);
  std::set<std::pair<int, int>> dead;
  for (const int channel : channels) {
    const auto* flat = BrightestBelowSaturation(pairs, statistics, result.transfer, channel);
    if (!flat) continue;
    const auto [a, b] = flat->read();
    const Pixels found = FindOutliers(a, b);
    CheckShare(found, a, "flats");
    for (const auto& pixel : found)
      if (mask[static_cast<std::size_t>(pixel.first) * a.width + pixel.second]) dead.insert(pixel);
  }
  result.dead.assign(dead.begin(), dead.end());
  if (!dead.empty()) {
    Mask(result.dead, result.width, mask);
    statistics = MeasureAll(pairs, mask);
    result.transfer = FitPhotonTransfer(statistics);
  }
  for (const int channel : channels) {
    ChannelCalibration c;
    c.channel = channel;
    const std::vector<PairStatistics> own = OfChannel(statistics, channel);
    c.transfer = FitPhotonTransfer(own);
    c.linearity = MeasureLinearity(own, c.transfer, channel);
    const auto* flat = BrightestBelowSaturation(pairs, statistics, result.transfer, channel);
    const auto [flat_a, flat_b] = flat->read();
    const auto [dark_a, dark_b] = DarkNearest(pairs, flat->exposure_s).read();
    const PatternVariance prnu = MeasurePrnuSquared(flat_a, flat_b, dark_a, dark_b, mask);
    c.prnu_squared = {prnu.value, prnu.sigma};
    c.prnu = RootOf(c.prnu_squared);
    const auto n = static_cast<double>(channels.size());
    result.prnu_squared.value += c.prnu_squared.value / n;
    // The channels see the same pixels: their errors need not be independent.
    result.prnu_squared.sigma += c.prnu_squared.sigma / n;
    result.channels.push_back(std::move(c));
  }
  result.prnu = RootOf(result.prnu_squared);
  return result;
}

SensorCalibration CalibrateSensor(const core::SessionReader& session, bool check_hashes) {
  const std::string file = (session.folder() / "session.json").string();
  const auto camera = core::Field<core::Json>(session.session(), "camera", file);
  RefuseMosaic(camera, file, "the sensor's calibration");
  const std::vector<CalibrationPair> pairs = PairsOfSession(session, check_hashes);
  SensorCalibration result;
  try {
    result = CalibrateSensor(pairs);
  } catch (const InputError& error) {
    // What frames show knows no file; frames that cannot be read have named theirs.
    const std::string folder = session.folder().string(), what = error.what();
    if (what.starts_with(folder)) throw;
    throw InputError(fmt::format("{}: {}", folder, what));
  }
  result.bits = core::Field<int>(camera, "bits", file);
  std::string hashes;
  for (const FrameRecord& record : session.frames()) hashes += record.sha256;
  result.provenance = {{"session_plan", session.plan_id()},
                       {"frames_sha256", core::Sha256(hashes)},
                       {"software", "luxfield " LUXFIELD_VERSION}};
  return result;
}

}  // namespace luxfield::reconstruct
