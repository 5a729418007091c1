#include "luxfield/reconstruct/merge/merge_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/reconstruct/bracket/bracket_levels.h"
#include "luxfield/reconstruct/bracket/bracket_reader.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/reconstruct/bracket/register_images.h"
#include "luxfield/reconstruct/bracket/register_mosaic.h"
#include "luxfield/reconstruct/bracket/session_plan.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"
#include "luxfield/reconstruct/calibrate/glare/calibrate_glare.h"
#include "luxfield/reconstruct/calibrate/sensor/flat_field.h"
#include "luxfield/reconstruct/calibrate/sensor/sensor_calibration_file.h"
#include "luxfield/reconstruct/merge/filter_profile.h"
#include "luxfield/reconstruct/merge/merge_positions.h"
#include "luxfield/reconstruct/merge/merge_session_json.h"
#include "luxfield/reconstruct/merge/tilt_effect_json.h"
#include "luxfield/session/frame_file.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Measurement;
using lightfield::Measurements;
using lightfield::Vec2;
using session::FrameKind;
using session::FrameRecord;
using session::RawFrame;

constexpr double kLargestDisplacement =
    0.1;  // spacings; a filter 0.01 off changes by 1.35 % (docs/lab.md)

using Records = BracketRecords;
using BracketKey = std::tuple<int, int, int, int>;  // j, i, print, channel

// The plan with what the calibrations say in place of it. Throws InputError for two of one kind.
SessionPlan Calibrated(SessionPlan plan, const MergeSessionOptions& options,
                       std::map<std::string, std::string>& provenance) {
  for (const std::filesystem::path& path : options.calibrations) {
    if (IsGlareCalibration(path)) {
      const StatedGlare glare = ReadGlareCalibration(path, plan.sensor);
      provenance["glare_calibration"] = glare.sha256;
      provenance["glare_share"] = fmt::format("{:.3g} +- {:.1g}", glare.share, glare.share_sigma);
      provenance["glare_bound"] = fmt::format("{:.3g}", glare.bound);
      continue;
    }
    const bool geometry = IsGeometryCalibration(path);
    const auto [entry, is_new] =
        provenance.try_emplace(geometry ? "geometry_calibration" : "sensor_calibration");
    if (!is_new)
      throw InputError(path.string(), "is the second calibration of its kind", "give one of each");
    entry->second =
        geometry ? ApplyGeometryCalibration(path, plan) : ApplySensorCalibration(path, plan.sensor);
  }
  if (!options.flat_field.empty())
    provenance["flat_field"] = ApplyFlatField(options.flat_field, plan.sensor);
  return plan;
}

struct Positions {
  int first = 0, last = -1;  // the last is none of them; -1: all of the plan from the first
};

class SessionMerger {
 public:
  SessionMerger(const session::SessionReader& session, const MergeSessionOptions& options,
                Positions positions = {})
      : session_(session),
        options_(options),
        plan_(Calibrated(ReadSessionPlan(session), options, provenance_)),
        registration_(plan_.image_from_sensor, plan_.sensor.width, plan_.sensor.height,
                      plan_.geometry.lattice, plan_.lens),
        positions_(positions.last < 0 ? Positions{positions.first, plan_.geometry.grid.count()}
                                      : positions),
        progress_("merge", static_cast<std::uint64_t>(positions_.last - positions_.first)) {
    if (positions_.first < 0 || positions_.first >= positions_.last ||
        positions_.last > plan_.geometry.grid.count())
      throw InputError(
          session.folder().string(),
          fmt::format("has {} positions, and not those from {} to {}", plan_.geometry.grid.count(),
                      positions_.first, positions_.last - 1),
          "ask for positions of its plan");
    for (const double responsivity : plan_.sensor.responsivity_e_per_s_per_w_m2) {
      const double per_rate = 1 / (responsivity * plan_.albedo * plan_.filter_scale);
      std::vector<float>& image = irradiance_per_rate_.emplace_back();
      if (plan_.sensor.vignetting.empty()) image.push_back(static_cast<float>(per_rate));
      for (const float v : plan_.sensor.vignetting)
        image.push_back(static_cast<float>(per_rate / v));
    }
    if (!plan_.sensor.cfa.empty()) {
      mosaic_.emplace(plan_.image_from_sensor, plan_.sensor.width, plan_.sensor.height,
                      plan_.geometry.lattice, plan_.lens, plan_.sensor.cfa, irradiance_per_rate_);
      if (options_.observer) own_irradiance_per_rate_ = OwnIrradiancePerRate();
    }
    print_factor_ = PrintFactors(plan_.filter, plan_.geometry.grid.basis);
    if (plan_.tilts) summary_.tilt = EffectOfTilts(plan_);
    AverageAllDarks();
    MeasureDrift();
    SortIntoBrackets();
    LeaveOutWrongLevels();
    QueueBrackets();
    if (options_.estimate_exposures) EstimateExposures();
  }

  // What the positions belong to, and where the stage stood at each.
  Measurements Header() {
    Measurements result;
    result.geometry = plan_.geometry;
    result.filter = plan_.filter;
    result.filter_scale = plan_.filter_scale;
    result.provenance = {
        {"session_plan", session_.plan_id()},
        {"merge_estimator",
         options_.merge.estimator == Estimator::kPoisson ? "poisson" : "inverse-variance"}};
    result.provenance.insert(provenance_.begin(), provenance_.end());
    if (options_.estimate_exposures) result.provenance["exposures"] = "estimated";
    const auto& grid = plan_.geometry.grid;
    for (int m = 0; m < grid.count(); ++m)
      result.positions.emplace_back().displacement_m = Displacement(m % grid.width, m / grid.width);
    return result;
  }

  // Position m; to be asked for in order, each once.
  Measurement Next(int m) {
    core::ThrowIfInterrupted();
    const auto& grid = plan_.geometry.grid;
    ++summary_.positions;
    Measurement position = MergePosition(m % grid.width, m / grid.width);
    progress_.Advance();
    return position;
  }

  const MergeSessionSummary& summary() const { return summary_; }

 private:
  void Require(const FrameRecord& record) const {
    const auto& grid = plan_.geometry.grid;
    if (record.i < 0 || record.i >= grid.width || record.j < 0 || record.j >= grid.height ||
        record.channel < 0 || record.channel >= ChannelsInTurn() || record.print < 0 ||
        record.print >= static_cast<int>(print_factor_.size()))
      throw InputError(
          (session_.folder() / "journal.jsonl").string(),
          fmt::format("frame '{}' of position ({}, {}), print {}, channel {} is not in plan.json",
                      record.file, record.i, record.j, record.print, record.channel),
          "run `luxfield verify` on the session");
  }

  void SortIntoBrackets() {
    for (const FrameRecord& record : session_.frames()) {
      if (record.kind != FrameKind::kPosition) continue;
      Require(record);
      brackets_[{record.j, record.i, record.print, record.channel}].push_back(&record);
      summary_.flagged_frames += record.flagged;
    }
  }

  // Whether capture doubts the levels of a bracket's frames. A flag on the shortest exposure says
  // that pixels are saturated, which the merge sees for itself.
  static bool HasDoubtfulLevels(const Records& records) {
    const auto shorter = [](const FrameRecord* a, const FrameRecord* b) {
      return a->exposure_s < b->exposure_s;
    };
    const double shortest_s =
        (*std::min_element(records.begin(), records.end(), shorter))->exposure_s;
    return std::any_of(records.begin(), records.end(), [&](const FrameRecord* record) {
      return record->flagged && record->exposure_s > shortest_s;
    });
  }

  // Frames whose level contradicts their bracket's are left out, and brackets of which nothing is
  // left: their positions are missing ones.
  void LeaveOutWrongLevels() {
    std::vector<BracketKey> keys;
    std::vector<Records> doubtful;
    for (const auto& [key, records] : brackets_)
      if (HasDoubtfulLevels(records)) {
        keys.push_back(key);
        doubtful.push_back(records);
      }
    BracketReader reader(session_, doubtful, options_.check_hashes);
    for (std::size_t n = 0; n < keys.size(); ++n) {
      core::ThrowIfInterrupted();
      const std::vector<Exposure> exposures = ExposuresOf(doubtful[n], reader.Next());
      const std::vector<bool> out =
          ContradictedFrames(plan_.sensor, exposures, plan_.level_tolerance);
      Records left;
      for (std::size_t k = 0; k < out.size(); ++k)
        if (!out[k]) left.push_back(doubtful[n][k]);
      summary_.frames_left_out += static_cast<int>(out.size() - left.size());
      summary_.brackets_left_out += left.empty();
      if (left.empty())
        brackets_.erase(keys[n]);
      else
        brackets_[keys[n]] = std::move(left);
    }
  }

  // Starts to read the brackets of positions that have all of theirs.
  void QueueBrackets() {
    std::vector<Records> queue;
    const auto& grid = plan_.geometry.grid;
    for (int m = positions_.first; m < positions_.last; ++m)
      for (const BracketKey& key : WholePosition(m % grid.width, m / grid.width))
        queue.push_back(brackets_.at(key));
    reader_.emplace(session_, std::move(queue), options_.check_hashes);
  }

  // Of every pixel of a mosaic in the colour that it sees.
  std::vector<float> OwnIrradiancePerRate() const {
    const rig::SensorModel& sensor = plan_.sensor;
    std::vector<float> own(static_cast<std::size_t>(sensor.width) * sensor.height);
    for (std::size_t p = 0; p < own.size(); ++p) {
      const std::vector<float>& of_colour = irradiance_per_rate_[ChannelOfPixel(sensor, p)];
      own[p] = of_colour[of_colour.size() == 1 ? 0 : p];
    }
    return own;
  }

  // A bracket each; one of a colour mosaic holds all channels.
  int ChannelsInTurn() const { return mosaic_ ? 1 : plan_.geometry.channels; }

  // The position's brackets in the order they are merged; empty if one was not taken.
  std::vector<BracketKey> WholePosition(int i, int j) const {
    std::vector<BracketKey> keys;
    for (int channel = 0; channel < ChannelsInTurn(); ++channel)
      for (int print = 0; print < static_cast<int>(print_factor_.size()); ++print) {
        keys.emplace_back(j, i, print, channel);
        if (!brackets_.contains(keys.back())) return {};
      }
    return keys;
  }

  void AverageAllDarks() {
    constexpr std::size_t kDarksAtOnce = 4;  // in memory, and as many read ahead
    std::vector<Records> pieces;
    std::map<double, Records> by_exposure;
    for (const FrameRecord& record : session_.frames()) {
      if (record.kind != FrameKind::kDark) continue;
      if (record.flagged)
        ++summary_.flagged_darks;  // light may have got in
      else
        by_exposure[record.exposure_s].push_back(&record);
    }
    for (const auto& [exposure_s, records] : by_exposure) {
      summary_.dark_frames += static_cast<int>(records.size());
      for (std::size_t first = 0; first < records.size(); first += kDarksAtOnce)
        pieces.emplace_back(records.begin() + static_cast<std::ptrdiff_t>(first),
                            records.begin() + static_cast<std::ptrdiff_t>(
                                                  std::min(first + kDarksAtOnce, records.size())));
    }
    BracketReader reader(session_, std::move(pieces), options_.check_hashes);
    for (const auto& [exposure_s, records] : by_exposure) {
      DarkSum sum(exposure_s);
      for (std::size_t first = 0; first < records.size(); first += kDarksAtOnce)
        sum.Add(reader.Next());
      darks_[exposure_s] = sum.Mean();
    }
  }

  const DarkFrame* DarkAt(double exposure_s) const {
    const auto dark = darks_.find(exposure_s);
    return dark == darks_.end() ? nullptr : &dark->second;
  }

  // Dark signal and black level of a pixel at an exposure time, DN.
  double Dark(double exposure_s, std::size_t pixel) const {
    if (const DarkFrame* dark = DarkAt(exposure_s)) return dark->mean_dn[pixel];
    const rig::SensorModel& sensor = plan_.sensor;
    return sensor.black_dn + sensor.gain_dn_per_e * sensor.dark_current_e_per_s * exposure_s;
  }

  void MeasureDrift() {
    // Frames compare with the first of the same channel and settings.
    struct Series {
      std::vector<std::size_t> pixels;
      double first = 0;
    };
    std::map<std::tuple<int, double, double>, Series> all;
    struct Point {
      const FrameRecord* record;
      double ratio;
    };
    std::vector<Point> points;
    std::string bytes;
    RawFrame frame;
    double monitor =
        0;  // sum of readings over ratios: the reading at the first reference, averaged
    int readings = 0;
    for (const FrameRecord& record : session_.frames()) {
      if (record.kind != FrameKind::kReference) continue;
      ++summary_.reference_frames;
      session::ReadFrame(session_, record, options_.check_hashes, &bytes, &frame);
      Series& series = all[{record.channel, record.exposure_s, record.attenuation}];
      const bool is_first = series.pixels.empty();
      if (is_first) series.pixels = ReferencePixels(plan_.sensor, frame);
      double sum = 0;
      for (const std::size_t pixel : series.pixels)
        sum += frame.at(pixel) - Dark(record.exposure_s, pixel);
      if (is_first) series.first = sum;
      if (!(series.first > 0 && sum > 0))
        throw InputError((session_.folder() / record.file).string(),
                         "the reference frame shows no light",
                         "check lamp and shutter, and capture again");
      points.push_back({&record, sum / series.first});
      // A flag says that the monitor gave no reading beside a frame that is good.
      const bool without_reading = record.flagged && record.meter == 0;
      if (options_.lamp_level == LampLevel::kMonitorUnity && !without_reading &&
          !(record.meter > 0))
        throw InputError((session_.folder() / "journal.jsonl").string(),
                         fmt::format("reference '{}' has no monitor reading", record.file),
                         "refer to the first reference frame instead");
      monitor += record.meter * series.first / sum;
      readings += !without_reading;
    }
    const bool by_monitor = options_.lamp_level == LampLevel::kMonitorUnity;
    if (by_monitor && readings == 0)
      throw InputError(session_.folder().string(), "has no reference frames with monitor readings",
                       "refer to the first reference frame instead");
    const double level = by_monitor ? monitor / readings : 1;
    std::vector<MergedReference> references;
    for (const auto& [record, ratio] : points) {
      drift_.Add(record->epoch, record->channel, record->t_start_s + record->exposure_s / 2,
                 ratio * level);
      const Series& series = all.at({record->channel, record->exposure_s, record->attenuation});
      references.push_back(
          {record, &series.pixels, ratio * series.first, DarkAt(record->exposure_s)});
    }
    if (options_.observer) options_.observer->OnReferences(references, drift_);
  }

  double LampFactor(const FrameRecord& record) const {
    return drift_.Factor(record.epoch, record.channel, record.t_start_s + record.exposure_s / 2);
  }

  std::vector<Exposure> ExposuresOf(const Records& records,
                                    std::span<const RawFrame> frames) const {
    std::vector<Exposure> exposures;
    for (std::size_t n = 0; n < records.size(); ++n) {
      const FrameRecord& record = *records[n];
      const double ratio = session_exposures_ ? session_exposures_->Ratio(record) : 1;
      exposures.push_back({&frames[n], ratio * record.exposure_s, record.attenuation,
                           LampFactor(record), DarkAt(record.exposure_s)});
    }
    return exposures;
  }

  // From brackets spread over the session.
  void EstimateExposures() {
    constexpr std::size_t kBrackets = 16;
    SessionExposures estimate(session_.frames());
    const std::size_t step =
        std::max<std::size_t>(1, (brackets_.size() + kBrackets - 1) / kBrackets);
    std::vector<Records> chosen;
    std::size_t number = 0;
    for (const auto& [key, records] : brackets_)
      if (number++ % step == 0) chosen.push_back(records);
    BracketReader reader(session_, chosen, options_.check_hashes);
    for (const Records& records : chosen) {
      core::ThrowIfInterrupted();
      const std::vector<Exposure> exposures = ExposuresOf(records, reader.Next());
      MergeExposures(plan_.sensor, exposures, options_.merge, &merged_);
      estimate.Add(plan_.sensor, records, exposures, options_.merge, merged_);
    }
    estimate.Solve();
    summary_.exposures = estimate.rungs();
    session_exposures_ = std::move(estimate);
    if (options_.observer) options_.observer->OnExposures(*session_exposures_);
  }

  // Merges the next bracket of the queue into merged_; where its filter was.
  Vec2 MergeBracket(const Records& records) {
    const std::span<const RawFrame> frames = reader_->Next();
    const std::vector<Exposure> exposures = ExposuresOf(records, frames);
    for (const Exposure& exposure : exposures) {
      const double factor = exposure.lamp_factor;
      const bool first = summary_.frames++ == 0;
      summary_.least_lamp_factor = first ? factor : std::min(summary_.least_lamp_factor, factor);
      summary_.largest_lamp_factor =
          first ? factor : std::max(summary_.largest_lamp_factor, factor);
    }
    MergeExposures(plan_.sensor, exposures, options_.merge, &merged_);
    const Vec2 centre = Centre(records);
    if (options_.observer) {
      const FrameRecord& first = *records[0];
      options_.observer->OnBracket(
          {first.i, first.j, first.print, first.channel, records, exposures, merged_,
           mosaic_ ? own_irradiance_per_rate_ : irradiance_per_rate_[first.channel], centre});
    }
    if (session_exposures_)
      session_exposures_->WidenSigma(plan_.sensor, records, exposures, options_.merge, &merged_);
    return centre;
  }

  // Where the filter's centre was, by the stage's read-back and its calibrated axes.
  Vec2 Centre(const Records& records) {
    Vec2 centre;
    for (const FrameRecord* record : records)
      centre = centre + Vec2{record->stage_u_m, record->stage_v_m};
    centre = (1.0 / static_cast<double>(records.size())) * centre;
    const auto& grid = plan_.geometry.grid;
    const Vec2 planned = grid.centre(records[0]->i, records[0]->j), off = centre - planned;
    const double displacement = std::hypot(off.x, off.y) / grid.spacing_m;
    summary_.largest_displacement = std::max(summary_.largest_displacement, displacement);
    if (!(displacement <= kLargestDisplacement))
      throw InputError((session_.folder() / "journal.jsonl").string(),
                       fmt::format("position ({}, {}): the stage read back ({} m, {} m), {:.2g} "
                                   "spacings from the planned ({} m, {} m)",
                                   records[0]->i, records[0]->j, centre.x, centre.y, displacement,
                                   planned.x, planned.y),
                       "home the stage and retake the position");
    return centre.x * plan_.stage_axes[0] + centre.y * plan_.stage_axes[1];
  }

  // The mean of the position's brackets; 0 if one was not taken.
  Vec2 Displacement(int i, int j) {
    const std::vector<BracketKey> keys = WholePosition(i, j);
    Vec2 off;
    for (const BracketKey& key : keys)
      off = off + (1.0 / static_cast<double>(keys.size())) *
                      (Centre(brackets_.at(key)) - plan_.geometry.grid.centre(i, j));
    // Rounding of the planned centres is no displacement.
    return std::hypot(off.x, off.y) < 1e-9 * plan_.geometry.grid.spacing_m ? Vec2{} : off;
  }

  Measurement MergePosition(int i, int j) {
    const std::size_t texels = plan_.geometry.plane_size();
    const int channels = plan_.geometry.channels, prints = static_cast<int>(print_factor_.size());
    Measurement position;
    position.irradiance.assign(texels * channels, 0);
    position.sigma.assign(texels * channels, 0);
    position.count.assign(texels, 0);
    position.mask.assign(texels, 0);
    if (WholePosition(i, j).empty()) {
      ++summary_.missing_positions;
      std::fill(position.mask.begin(), position.mask.end(), lightfield::kOffSensor);
      return position;
    }
    position.displacement_m = Displacement(i, j);
    position.count.assign(texels, std::numeric_limits<float>::max());
    std::vector<double> value(texels * channels), variance(texels * channels);
    const auto add = [&](int channel, int print, const RegisteredImage& image) {
      const double factor = print_factor_[print];
      for (std::size_t p = 0; p < texels; ++p) {
        value[channel * texels + p] += factor * image.value[p];
        variance[channel * texels + p] += factor * factor * image.sigma[p] * image.sigma[p];
        position.count[p] = std::min(position.count[p], image.count[p]);
        position.mask[p] |= image.mask[p];
      }
    };
    for (int channel = 0; channel < ChannelsInTurn(); ++channel)
      for (int print = 0; print < prints; ++print) {
        const Vec2 centre = MergeBracket(brackets_.at({j, i, print, channel}));
        if (mosaic_) {
          for (int colour = 0; colour < channels; ++colour)
            add(colour, print, mosaic_->Apply(merged_, colour, centre));
        } else {
          add(channel, print, registration_.Apply(merged_, irradiance_per_rate_[channel], centre));
        }
      }
    for (std::size_t k = 0; k < value.size(); ++k) {
      position.irradiance[k] = static_cast<float>(value[k]);
      position.sigma[k] = static_cast<float>(std::sqrt(variance[k]));
    }
    for (std::size_t k = 0; k < value.size(); ++k) {
      std::uint32_t& mask = position.mask[k % texels];
      if (mask & lightfield::kUnknownMask)
        position.irradiance[k] = position.sigma[k] = position.count[k % texels] = 0;
      else if (!lightfield::IsDetected(position.irradiance[k], position.sigma[k]))
        mask |= lightfield::kTooDark;
    }
    return position;
  }

  const session::SessionReader& session_;
  MergeSessionOptions options_;
  std::map<std::string, std::string> provenance_;  // of calibrations: before plan_, which fills it
  SessionPlan plan_;
  Registration registration_;
  std::optional<MosaicRegistration> mosaic_;  // of a sensor with a colour mosaic
  std::vector<std::vector<float>>
      irradiance_per_rate_;                     // per channel: one entry, or one per sensor pixel
  std::vector<float> own_irradiance_per_rate_;  // of a mosaic under an observer: per sensor pixel
  std::vector<double> print_factor_;            // of each print of a position
  std::map<double, DarkFrame> darks_;           // by exposure time
  LampDrift drift_;
  std::map<BracketKey, Records> brackets_;
  std::optional<BracketReader> reader_;
  std::optional<SessionExposures> session_exposures_;  // none: as read back
  MergedFrame merged_;                                 // of the bracket at hand
  MergeSessionSummary summary_;
  Positions positions_;
  core::Progress progress_;
};

}  // namespace

void LampDrift::Add(int epoch, int channel, double time_s, double factor) {
  series_[{epoch, channel}][time_s] = factor;
}

std::vector<LampDrift::Share> LampDrift::Shares(int epoch, int channel, double time_s) const {
  const auto found = series_.find({epoch, channel});
  if (found == series_.end()) return {};
  const std::map<double, double>& series = found->second;
  const auto after = series.lower_bound(time_s);
  if (after == series.begin()) return {{after->first, after->second, 1}};
  const auto before = std::prev(after);
  if (after == series.end()) return {{before->first, before->second, 1}};
  const double share = (time_s - before->first) / (after->first - before->first);
  return {{before->first, before->second, 1 - share}, {after->first, after->second, share}};
}

double LampDrift::Factor(int epoch, int channel, double time_s) const {
  const std::vector<Share> shares = Shares(epoch, channel, time_s);
  double factor = shares.empty() ? 1 : 0;
  for (const Share& share : shares) factor += share.share * share.factor;
  return factor;
}

SessionPlan CalibratedPlan(const session::SessionReader& session,
                           const MergeSessionOptions& options) {
  std::map<std::string, std::string> provenance;
  return Calibrated(ReadSessionPlan(session), options, provenance);
}

std::vector<std::size_t> ReferencePixels(const rig::SensorModel& sensor, const RawFrame& frame) {
  const double black = sensor.black_dn, range = sensor.saturation_dn - black;
  std::vector<std::size_t> bright, usable;
  for (std::size_t p = 0; p < frame.size(); ++p) {
    const double level = (frame.at(p) - black) / range;
    if (level < 0.8) usable.push_back(p);
    if (level < 0.8 && level > 0.05) bright.push_back(p);
  }
  return bright.empty() ? usable : bright;
}

Measurements MergeSession(const session::SessionReader& session, const MergeSessionOptions& options,
                          MergeSessionSummary* summary) {
  SessionMerger merger(session, options);
  Measurements result = merger.Header();
  for (int m = 0; m < result.geometry.grid.count(); ++m) result.positions[m] = merger.Next(m);
  if (summary) *summary = merger.summary();
  return result;
}

void MergeSessionToFile(const session::SessionReader& session, const std::filesystem::path& output,
                        const MergeSessionOptions& options, MergeSessionSummary* summary) {
  SessionMerger merger(session, options);
  lightfield::WriteMeasurements(output, merger.Header(), [&](int m) { return merger.Next(m); });
  if (summary) *summary = merger.summary();
}

void MergePositionsToFile(const session::SessionReader& session,
                          const std::filesystem::path& output, int first, int last,
                          const MergeSessionOptions& options, MergeSessionSummary* summary) {
  SessionMerger merger(session, options, {first, last});
  lightfield::WriteMeasurementPositions(output, merger.Header(), first, last,
                                        [&](int m) { return merger.Next(m); });
  if (summary) *summary = merger.summary();
}

nlohmann::json ToJson(const MergeSessionSummary& summary) {
  nlohmann::json exposures = nlohmann::json::array();
  for (const RungExposure& rung : summary.exposures)
    exposures.push_back({{"read_back_s", rung.exposure_s},
                         {"attenuation", rung.attenuation},
                         {"ratio", rung.ratio.value},
                         {"ratio_sigma", rung.ratio.sigma},
                         {"known", rung.known}});
  return {{"exposures", exposures},
          {"positions", summary.positions},
          {"frames", summary.frames},
          {"flagged_frames", summary.flagged_frames},
          {"frames_left_out", summary.frames_left_out},
          {"brackets_left_out", summary.brackets_left_out},
          {"flagged_darks", summary.flagged_darks},
          {"dark_frames", summary.dark_frames},
          {"reference_frames", summary.reference_frames},
          {"missing_positions", summary.missing_positions},
          {"least_lamp_factor", summary.least_lamp_factor},
          {"largest_lamp_factor", summary.largest_lamp_factor},
          {"largest_displacement", summary.largest_displacement},
          {"tilt", summary.tilt ? ToJson(*summary.tilt) : nlohmann::json()}};
}

}  // namespace luxfield::reconstruct
