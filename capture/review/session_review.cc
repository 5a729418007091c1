#include "luxfield/capture/review/session_review.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <unordered_set>

#include "luxfield/capture/lamp/lamp_frequency.h"
#include "luxfield/capture/take/capture.h"
#include "luxfield/capture/take/missing_frames.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/session/folder_lock.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/session_path.h"
#include "luxfield/session/session_replay.h"
#include "luxfield/session/stated.h"

namespace luxfield::capture {
namespace {

namespace fs = std::filesystem;
using core::Field;
using core::Json;
using session::FrameKind;
using session::FrameRecord;

// A finite number, where there is one.
std::optional<double> Number(const Json& json, const char* key) {
  if (!json.is_object() || !json.contains(key) || !json.at(key).is_number()) return std::nullopt;
  const double value = json.at(key).get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

const Json& ObjectIn(const Json& json, const char* key) {
  static const Json none = Json::object();
  return json.is_object() && json.contains(key) && json.at(key).is_object() ? json.at(key) : none;
}

// "2026-11-21T13:50:29.123Z" as seconds since 1970.
std::optional<double> UnixSeconds(const std::string& utc) {
  int year = 0;
  unsigned month = 0, day = 0;
  int hour = 0, minute = 0;
  double second = 0;
  if (std::sscanf(utc.c_str(), "%d-%u-%uT%d:%d:%lf", &year, &month, &day, &hour, &minute,
                  &second) != 6)
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  if (!date.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch();
  return 86400.0 * static_cast<double>(days.count()) + 3600 * hour + 60 * minute + second;
}

// A reason with its numbers taken out, so that equal ones can be counted.
std::string WithoutNumbers(const std::string& reason) {
  std::string text;
  for (const char c : reason) {
    const bool digit = std::isdigit(static_cast<unsigned char>(c));
    const bool inside = !text.empty() && text.back() == '#' &&
                        (digit || c == '.' || c == 'e' || c == '-' || c == '+');
    if (inside) continue;
    text += digit ? '#' : c;
  }
  return text;
}

void Raise(std::optional<double>& largest, std::optional<double> value) {
  if (value) largest = std::max(largest.value_or(*value), *value);
}

// One pass over a journal.
class Reviewer {
 public:
  Reviewer(const session::SessionReader& session, const session::PlanFile& plan,
           SessionReview& review)
      : folder_(session.folder()), journal_((folder_ / "journal.jsonl").string()), review_(review) {
    for (const FrameRecord& record : session.frames()) usable_.insert(record.file);
    if (const auto camera = session::SetupOf(session).camera) {
      black_dn_ = camera->black_dn;
      if (camera->saturation_dn && black_dn_) range_dn_ = *camera->saturation_dn - *black_dn_;
    }
    if (plan.kind == session::PlanKind::kLightField) TakePositions(plan);
  }

  void See(const Json& record, std::size_t line) {
    where_ = fmt::format("{} line {}", journal_, line);
    const auto type = Field<std::string>(record, "type", where_);
    const double t_s = Field<double>(record, "t_s", where_);
    const auto utc = Field<std::string>(record, "utc", where_);
    if (type == "session_open") first_utc_ = UnixSeconds(utc);
    if (type == "session_open" || type == "epoch_start") Anchor(t_s, utc);
    now_s_ = std::max(now_s_, anchor_s_ + t_s - anchor_t_s_);
    if (type == "epoch_start")
      Epoch(record, utc);
    else if (type == "frame")
      Frame(record);
    else if (type == "frame_rejected")
      Rejected(record);
    else if (type == "reference")
      Reference(record);
    else if (type == "probe")
      ++review_.counts.probes;
    else if (type == "supply")
      Supply(record);
    else
      Event(record, type, utc);
    if (!review_.epochs.empty()) review_.epochs.back().end_s = now_s_;
    review_.duration_s = now_s_;
  }

  void End() {
    for (auto& [exposure, levels] : levels_) Summarise(exposure, levels);
    for (auto& [place, brackets] : brackets_) {
      ReviewedPosition& position = review_.positions[place_.at(place)];
      for (const auto& [bracket, ends] : brackets) {
        Raise(position.saturated_share, ends.saturated);
        Raise(position.black_share, ends.black);
      }
    }
    for (const auto& [reason, counted] : reasons_) review_.reasons.push_back(counted);
    std::stable_sort(review_.reasons.begin(), review_.reasons.end(),
                     [](const auto& a, const auto& b) { return a.frames > b.frames; });
    if (!darks_.empty()) {
      review_.sensor.dark_exposure_s = darks_.rbegin()->first;
      review_.sensor.dark_dn = darks_.rbegin()->second;
    }
  }

 private:
  using Place = std::pair<int, int>;
  struct Levels {
    std::vector<float> brightest, mean;
    double saturated = 0, black = 0;
    int frames = 0, flagged = 0;
  };
  // What a bracket's shortest and longest exposures show.
  struct BracketEnds {
    double shortest_s = HUGE_VAL, longest_s = 0;
    std::optional<double> saturated, black;
  };

  void TakePositions(const session::PlanFile& plan) {
    const std::string file = (folder_ / "plan.json").string();
    for (const session::PlannedPosition& p : session::Stated(plan.positions, "positions", file)) {
      ReviewedPosition position;
      position.i = p.i;
      position.j = p.j;
      set_points_.push_back({p.centre.x, p.centre.y});
      place_.try_emplace({position.i, position.j}, review_.positions.size());
      review_.positions.push_back(position);
    }
    review_.plan.positions = static_cast<int>(review_.positions.size());
    if (plan.geometry) review_.plan.spacing_m = plan.geometry->grid.spacing_m;
    if (plan.reference) review_.plan.max_drift = plan.reference->policy.max_drift;
  }

  // A new process: its monotonic clock may be another one.
  void Anchor(double t_s, const std::string& utc) {
    const auto unix_s = UnixSeconds(utc);
    anchor_t_s_ = t_s;
    anchor_s_ = now_s_;
    if (unix_s && first_utc_) anchor_s_ = std::max(now_s_, *unix_s - *first_utc_);
  }
  double Since(double t_s) const { return std::max(0.0, anchor_s_ + t_s - anchor_t_s_); }

  ReviewedPosition* PositionAt(const Json& record) {
    const auto found =
        place_.find({Field<int>(record, "i", where_), Field<int>(record, "j", where_)});
    return found == place_.end() ? nullptr : &review_.positions[found->second];
  }

  void AddEvent(const std::string& utc, std::string what) {
    review_.events.push_back({now_s_, utc, std::move(what)});
  }

  void Epoch(const Json& record, const std::string& utc) {
    if (!review_.epochs.empty()) {
      const ReviewedEpoch& before = review_.epochs.back();
      if (!before.paused && !before.suspended)
        review_.events.push_back({before.end_s, "",
                                  fmt::format("epoch {} was cut short: the program died, or was "
                                              "ended by an error",
                                              before.number)});
    }
    ReviewedEpoch epoch;
    epoch.number = Field<int>(record, "epoch", where_);
    epoch.begin_s = now_s_;
    epoch.utc = utc;
    epoch.devices = Field<Json>(record, "devices", where_);
    const bool changed = !review_.epochs.empty() && review_.epochs.back().devices != epoch.devices;
    AddEvent(utc, fmt::format("epoch {} begins{}", epoch.number,
                              changed ? ", with other devices than the one before" : ""));
    review_.epochs.push_back(std::move(epoch));
  }

  void Flicker(const Json& record, const std::string& utc) {
    std::string text = fmt::format("flicker: levels scatter by {:.2g} %, noise explains {:.2g} %",
                                   100 * Field<double>(record, "scatter", where_),
                                   100 * Field<double>(record, "noise", where_));
    const double stated_hz = Number(record, "stated_hz").value_or(0);
    const double hz = Number(record, "hz").value_or(0);
    const double sigma_hz = Number(record, "sigma_hz").value_or(0);
    if (hz > 0 && sigma_hz > 0) {
      review_.lamp.pulses = ReviewedPulses{hz, sigma_hz, stated_hz};
      text += "; the lamp pulses at " + FormatHertz(hz, sigma_hz);
    }
    if (stated_hz > 0) text += fmt::format("; exposures are whole periods of {:.8g} Hz", stated_hz);
    AddEvent(utc, text);
  }

  void Event(const Json& record, const std::string& type, const std::string& utc) {
    if (type == "paused") {
      if (!review_.epochs.empty()) review_.epochs.back().paused = true;
      AddEvent(utc, "paused: " + Field<std::string>(record, "reason", where_));
    } else if (type == "suspended") {
      if (!review_.epochs.empty()) review_.epochs.back().suspended = true;
      const double ratio = Field<double>(record, "ratio", where_);
      const auto retake = Field<std::vector<std::pair<int, int>>>(record, "retake", where_).size();
      review_.lamp.suspended_ratio.push_back({now_s_, ratio});
      AddEvent(utc, fmt::format("suspended: a reference is at {:.4f} of the first; {} position{} "
                                "since the one before do not count",
                                ratio, retake, retake == 1 ? "" : "s"));
    } else if (type == "drift") {
      review_.lamp.suspended_ratio.push_back({now_s_, Field<double>(record, "ratio", where_)});
    } else if (type == "resumed") {
      AddEvent(utc, "goes on after waiting " +
                        core::FormatDuration(Field<double>(record, "waited_s", where_)));
    } else if (type == "flicker") {
      Flicker(record, utc);
    } else if (type == "clock_jump") {
      AddEvent(utc, fmt::format("the computer's time moved by {:.4g} s against its clock",
                                Field<double>(record, "by_s", where_)));
    } else if (type == "warm_up") {
      AddEvent(utc, fmt::format("lamp warm after {}, varying by {:.2g} %",
                                core::FormatDuration(Field<double>(record, "waited_s", where_)),
                                100 * Field<double>(record, "variation", where_)));
    } else if (type == "sealed") {
      if (!review_.epochs.empty()) review_.epochs.back().sealed = true;
      AddEvent(utc, "sealed: " + Field<std::string>(record, "status", where_));
    }
  }

  void Supply(const Json& record) {
    if (const auto volts = Number(record, "voltage_v"))
      review_.lamp.voltage_v.push_back({now_s_, *volts});
    if (const auto amperes = Number(record, "current_a"))
      review_.lamp.current_a.push_back({now_s_, *amperes});
  }

  void Rejected(const Json& record) {
    ++review_.counts.rejected;
    const auto reason = Field<std::string>(record, "reason", where_);
    RejectedReason& counted = reasons_[WithoutNumbers(reason)];
    if (counted.frames++ == 0) {
      counted.reason = WithoutNumbers(reason);
      counted.example = reason;
    }
    if (ReviewedPosition* position = PositionAt(record))
      ++position->rejected;
    else
      ++review_.counts.rejected_elsewhere;
  }

  void Reference(const Json& record) {
    const int channel = Field<int>(record, "channel", where_);
    const double ratio = Field<double>(record, "ratio", where_);
    review_.lamp.reference_ratio[channel].push_back({now_s_, ratio});
    // The monitor's part: over what it read at the channel's first reference.
    const auto meter = reference_meter_.find(channel);
    if (meter == reference_meter_.end() || meter->second <= 0) return;
    const double first = first_meter_.try_emplace(channel, meter->second).first->second;
    review_.lamp.reference_over_meter.push_back({now_s_, ratio * first / meter->second});
  }

  void Frame(const Json& json) {
    const FrameRecord record = session::FrameFromJson(json, where_);
    const Json& checks = ObjectIn(json, "checks");
    const double t_s = Since(record.t_start_s);
    const bool lit = record.kind != FrameKind::kDark;
    const bool usable = usable_.contains(record.file);
    ++review_.counts.frames;
    review_.counts.superseded += !usable;
    review_.counts.flagged += usable && record.flagged;
    LookAtFile(record, json);
    if (!review_.epochs.empty()) {
      ReviewedEpoch& epoch = review_.epochs.back();
      ++epoch.frames;
      epoch.committed.push_back({now_s_, static_cast<double>(review_.counts.frames)});
    }
    if (const auto celsius = Number(checks, "temperature_c"))
      review_.sensor.temperature_c.push_back({t_s, *celsius});
    if (lit && record.meter > 0) {
      if (first_lit_meter_ == 0) first_lit_meter_ = record.meter;
      review_.lamp.meter_ratio.push_back({t_s, record.meter / first_lit_meter_});
    }
    const auto mean_dn = Number(checks, "mean_dn");
    if (record.kind == FrameKind::kReference) {
      reference_meter_[record.channel] = record.meter;
    } else if (!lit) {
      if (mean_dn && black_dn_) darks_[record.exposure_s].push_back({t_s, *mean_dn - *black_dn_});
    } else if (usable) {
      Exposure(record, checks);
      if (record.kind == FrameKind::kPosition) Position(record, checks);
    }
  }

  void LookAtFile(const FrameRecord& record, const Json& json) {
    const auto bytes = Number(json, "bytes");
    review_.counts.bytes += bytes.value_or(0);
    std::error_code error;
    const auto size = fs::file_size(session::SessionFile(folder_, record.file, where_), error);
    if (error)
      ++review_.counts.files_missing;
    else if (bytes && static_cast<double>(size) != *bytes)
      ++review_.counts.files_other_size;
  }

  void Exposure(const FrameRecord& record, const Json& checks) {
    Levels& levels = levels_[record.exposure_s];
    ++levels.frames;
    levels.flagged += record.flagged;
    levels.saturated += Number(checks, "saturated_share").value_or(0);
    levels.black += Number(checks, "black_share").value_or(0);
    const auto level = [&](const char* key, std::vector<float>& values) {
      const auto dn = Number(checks, key);
      if (dn && range_dn_ && *range_dn_ > 0)
        values.push_back(static_cast<float>((*dn - *black_dn_) / *range_dn_));
    };
    level("brightest_dn", levels.brightest);
    level("mean_dn", levels.mean);
  }

  void Position(const FrameRecord& record, const Json& checks) {
    const auto found = place_.find({record.i, record.j});
    if (found == place_.end()) return;
    ReviewedPosition& position = review_.positions[found->second];
    position.whole = true;
    ++position.frames;
    position.flagged += record.flagged;
    const auto& set = set_points_[found->second];
    position.residual_m = {{set[0] - record.stage_u_m, set[1] - record.stage_v_m}};
    BracketEnds& ends = brackets_[found->first][{record.print, record.channel}];
    if (record.exposure_s < ends.shortest_s) ends.saturated.reset();
    if (record.exposure_s > ends.longest_s) ends.black.reset();
    ends.shortest_s = std::min(ends.shortest_s, record.exposure_s);
    ends.longest_s = std::max(ends.longest_s, record.exposure_s);
    if (record.exposure_s == ends.shortest_s)
      Raise(ends.saturated, Number(checks, "saturated_share"));
    if (record.exposure_s == ends.longest_s) Raise(ends.black, Number(checks, "black_share"));
  }

  void Summarise(double exposure_s, Levels& levels) {
    const auto median = [](std::vector<float>& values) {
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      return static_cast<double>(*middle);
    };
    ReviewedExposure exposure;
    exposure.exposure_s = exposure_s;
    exposure.frames = levels.frames;
    exposure.flagged = levels.flagged;
    exposure.saturated_share = levels.saturated / levels.frames;
    exposure.black_share = levels.black / levels.frames;
    if (!levels.brightest.empty()) {
      const auto [least, most] =
          std::minmax_element(levels.brightest.begin(), levels.brightest.end());
      const double lowest = *least, highest = *most;
      exposure.brightest = {{lowest, median(levels.brightest), highest}};
    }
    if (!levels.mean.empty()) exposure.mean = median(levels.mean);
    review_.exposures.push_back(exposure);
  }

  fs::path folder_;
  std::string journal_, where_;
  SessionReview& review_;
  std::unordered_set<std::string> usable_;  // files
  std::optional<double> black_dn_, range_dn_, first_utc_;
  double now_s_ = 0, anchor_s_ = 0, anchor_t_s_ = 0;
  std::map<Place, std::size_t> place_;  // into positions
  std::vector<std::array<double, 2>> set_points_;
  std::map<Place, std::map<std::pair<int, int>, BracketEnds>> brackets_;  // print and channel
  std::map<double, Levels> levels_;                                       // by exposure time
  std::map<double, TimeSeries> darks_;
  std::map<std::string, RejectedReason> reasons_;
  std::map<int, double> reference_meter_, first_meter_;  // by channel
  double first_lit_meter_ = 0;
};

}  // namespace

SessionReview ReviewSession(const fs::path& folder, bool verify) {
  SessionReview review;
  review.state.in_use = session::FolderInUse(folder);
  const session::SessionReader session(folder);
  const session::PlanFile plan = session::PlanOf(session);
  review.plan.name = plan.name;
  review.plan.kind = session::PlanKindName(plan.kind);
  review.plan.id = session.plan_id();
  review.state.sealed = session.sealed();
  review.counts.missing = MissingFrames(session);
  review.setup.camera = ObjectIn(session.session(), "camera");
  review.setup.devices = ObjectIn(session.session(), "devices");
  review.setup.software = ObjectIn(session.session(), "software");
  Reviewer reviewer(session, plan, review);
  const session::JournalEnd end =
      session::VisitJournal(folder / "journal.jsonl",
                            [&](Json&& record, std::size_t line) { reviewer.See(record, line); });
  review.state.torn = end.torn;
  reviewer.End();
  review.edges = FindSessionEdges(session);
  if (verify) review.check = VerifySession(folder);
  return review;
}

std::vector<Bin> Binned(const TimeSeries& series, int count) {
  if (series.empty() || count < 1) return {};
  const auto [first, last] =
      std::minmax_element(series.begin(), series.end(),
                          [](const TimedValue& a, const TimedValue& b) { return a.t_s < b.t_s; });
  const double begin_s = first->t_s, span_s = last->t_s - first->t_s;
  std::vector<Bin> bins(static_cast<std::size_t>(count));
  std::vector<int> values(bins.size(), 0);
  for (const TimedValue& v : series) {
    const double place = span_s > 0 ? (v.t_s - begin_s) / span_s * count : 0;
    const auto n = std::min(bins.size() - 1, static_cast<std::size_t>(std::max(0.0, place)));
    Bin& bin = bins[n];
    bin.min = values[n] == 0 ? v.value : std::min(bin.min, v.value);
    bin.max = values[n] == 0 ? v.value : std::max(bin.max, v.value);
    bin.t_s += v.t_s;
    bin.mean += v.value;
    ++values[n];
  }
  std::vector<Bin> filled;
  for (std::size_t n = 0; n < bins.size(); ++n) {
    if (values[n] == 0) continue;
    bins[n].t_s /= values[n];
    bins[n].mean /= values[n];
    filled.push_back(bins[n]);
  }
  return filled;
}

}  // namespace luxfield::capture
