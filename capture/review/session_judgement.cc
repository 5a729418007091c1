// What a session's review amounts to, in sentences and as JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/capture/lamp/lamp_frequency.h"
#include "luxfield/capture/review/session_review.h"
#include "luxfield/core/json.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/edge_light_json.h"

namespace luxfield::capture {
namespace {

using core::Json;

constexpr double kManyRejected = 0.05;  // of all frames: then something is wrong with the camera
constexpr double kWarmer_K = 5;         // dark current has doubled some 6 K further on
constexpr double kFarOff = 0.01;        // of the spacing between positions
constexpr double kOtherCurrent = 0.01;  // relative change of the lamp's current
constexpr int kJsonBins = 500;

std::string Count(int n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

// Least and largest value.
std::pair<double, double> RangeOf(const TimeSeries& series) {
  const auto [low, high] = std::minmax_element(
      series.begin(), series.end(),
      [](const TimedValue& a, const TimedValue& b) { return a.value < b.value; });
  return {low->value, high->value};
}

std::string Range(double low, double high) {
  const std::string from = fmt::format("{:.4g}", low), to = fmt::format("{:.4g}", high);
  return from == to ? from : from + " to " + to;
}

// Largest departure from 1.
double Departure(const TimeSeries& ratio) {
  const auto [low, high] = RangeOf(ratio);
  return std::max(std::abs(low - 1), std::abs(high - 1));
}

Judgement Wholeness(const SessionReview& r) {
  const bool light_field = r.plan.kind == "light-field";
  const std::string planned =
      light_field ? Count(r.plan.positions, "position", "positions") : "frames";
  if (r.counts.missing > 0 && r.state.in_use)
    return {Verdict::kLook, fmt::format("The capture is running: {} of {} are not there yet.",
                                        r.counts.missing, planned)};
  if (r.counts.missing > 0)
    return {Verdict::kBad,
            fmt::format("{} of {} are missing; `luxfield capture --resume` takes them.",
                        r.counts.missing, light_field ? planned : "the plan's frames")};
  if (!r.state.sealed)
    return {Verdict::kLook,
            fmt::format("All {} are there, but the session is not sealed{}", planned,
                        r.state.in_use ? ": the capture is running."
                                       : "; `luxfield capture --resume` ends it.")};
  return {Verdict::kGood,
          fmt::format("Whole and sealed: all {} in {}.", light_field ? planned : "planned frames",
                      Count(r.counts.frames - r.counts.superseded, "frame", "frames"))};
}

void JudgeEpochs(const SessionReview& r, std::vector<Judgement>& list) {
  if (r.epochs.size() < 2) return;
  int paused = 0, suspended = 0, cut = 0;
  bool changed = false;
  for (std::size_t n = 0; n + 1 < r.epochs.size(); ++n) {
    ++(r.epochs[n].paused ? paused : r.epochs[n].suspended ? suspended : cut);
    changed |= r.epochs[n].devices != r.epochs[n + 1].devices;
  }
  list.push_back(
      {changed ? Verdict::kLook : Verdict::kGood,
       fmt::format(
           "Captured in {} epochs: paused {}, suspended {}, cut short {}; every bracket is of one "
           "epoch{}.",
           r.epochs.size(), Count(paused, "time", "times"), Count(suspended, "time", "times"),
           Count(cut, "time", "times"),
           changed ? ", but devices changed between epochs (below)" : "")});
}

void JudgeLamp(const SessionReview& r, std::vector<Judgement>& list) {
  double drift = 0;
  for (const auto& [channel, ratio] : r.lamp.reference_ratio)
    drift = std::max(drift, Departure(ratio));
  if (!r.lamp.reference_ratio.empty()) {
    const bool beyond = r.plan.max_drift && drift > *r.plan.max_drift;
    std::string text =
        fmt::format("The lamp {} {:.3g} % {} its first reference",
                    beyond ? "went" : "stayed within", 100 * drift, beyond ? "from" : "of");
    if (r.plan.max_drift)
      text += fmt::format("; the plan allows {:.3g} %", 100 * *r.plan.max_drift);
    list.push_back({beyond ? Verdict::kLook : Verdict::kGood, text + "."});
  }
  if (r.lamp.pulses) {
    const bool whole = r.lamp.pulses->whole_periods_of_hz > 0;
    list.push_back({Verdict::kGood,
                    fmt::format("The lamp pulses at {}{}.",
                                FormatHertz(r.lamp.pulses->hz, r.lamp.pulses->sigma_hz),
                                whole ? fmt::format(", exposures are whole periods of {:.8g} Hz",
                                                    r.lamp.pulses->whole_periods_of_hz)
                                      : "")});
  }
  if (r.lamp.reference_over_meter.size() > 1) {
    const double apart = Departure(r.lamp.reference_over_meter);
    const bool far = r.plan.max_drift && apart > *r.plan.max_drift;
    list.push_back(
        {far ? Verdict::kLook : Verdict::kGood,
         fmt::format("References and light meter {} {:.3g} %{}.", far ? "part by" : "agree to",
                     100 * apart, far ? ": something besides the lamp changed" : "")});
  }
  if (!r.lamp.current_a.empty()) {
    const auto [low, high] = RangeOf(r.lamp.current_a);
    const bool other = high - low > kOtherCurrent * std::abs(high);
    list.push_back({other ? Verdict::kLook : Verdict::kGood,
                    fmt::format("The lamp's current was {} A.", Range(low, high))});
  }
}

void JudgeFrames(const SessionReview& r, std::vector<Judgement>& list) {
  const int taken = r.counts.frames + r.counts.rejected;
  const bool many = r.counts.rejected > kManyRejected * taken;
  list.push_back({many ? Verdict::kLook : Verdict::kGood,
                  r.counts.rejected == 0
                      ? std::string("No frame failed its checks.")
                      : fmt::format("{} of {} failed the checks and were taken again ({:.2g} %).",
                                    Count(r.counts.rejected, "exposure", "exposures"), taken,
                                    100.0 * r.counts.rejected / std::max(1, taken))});
  if (r.counts.flagged > 0)
    list.push_back(
        {Verdict::kLook, fmt::format("{} failed the checks at every attempt: kept, flagged.",
                                     Count(r.counts.flagged, "frame", "frames"))});
  const auto saturated =
      std::count_if(r.positions.begin(), r.positions.end(),
                    [](const ReviewedPosition& p) { return p.saturated_share.value_or(0) > 0; });
  if (saturated > 0)
    list.push_back({Verdict::kLook,
                    fmt::format("{} saturated pixels even in the shortest exposure of a bracket.",
                                saturated == 1 ? "1 position has"
                                               : fmt::format("{} positions have", saturated))});
}

void JudgeBench(const SessionReview& r, std::vector<Judgement>& list) {
  double residual_m = 0;
  bool any = false;
  for (const ReviewedPosition& p : r.positions)
    if (p.residual_m) {
      any = true;
      residual_m = std::max(residual_m, std::hypot((*p.residual_m)[0], (*p.residual_m)[1]));
    }
  if (any && r.plan.spacing_m) {
    const bool far = residual_m > kFarOff * *r.plan.spacing_m;
    list.push_back(
        {far ? Verdict::kLook : Verdict::kGood,
         fmt::format("The stage read back within {:.3g} um of its set points, {:.2g} % of their "
                     "spacing.",
                     1e6 * residual_m, 100 * residual_m / *r.plan.spacing_m)});
  }
  if (!r.sensor.temperature_c.empty()) {
    const auto [low, high] = RangeOf(r.sensor.temperature_c);
    list.push_back(
        {high - low > kWarmer_K ? Verdict::kLook : Verdict::kGood,
         fmt::format(
             "The sensor was at {} degrees C{}.", Range(low, high),
             high - low > kWarmer_K ? ": darks of one end do not fit frames of the other" : "")});
  }
}

Judgement Files(const SessionReview& r) {
  if (r.check && !r.check->problems.empty())
    return {Verdict::kBad,
            fmt::format("`verify` found {}, the first: {}.",
                        Count(static_cast<int>(r.check->problems.size()), "problem", "problems"),
                        r.check->problems.front())};
  if (r.check)
    return {Verdict::kGood, fmt::format("Every byte was checked: {} match their hashes.",
                                        Count(r.check->frames, "frame", "frames"))};
  if (r.counts.files_missing + r.counts.files_other_size > 0)
    return {Verdict::kBad,
            fmt::format("{} missing and {} of another size than written; `luxfield verify "
                        "--salvage` keeps what is whole.",
                        r.counts.files_missing == 1
                            ? "1 file is"
                            : fmt::format("{} files are", r.counts.files_missing),
                        r.counts.files_other_size)};
  return {Verdict::kGood,
          "All files are there with the sizes written; their bytes were not checked here, "
          "`luxfield verify` or `report --verify` does it."};
}

Json SeriesJson(const TimeSeries& series) {
  Json json = Json::array();
  for (const Bin& b : Binned(series, kJsonBins))
    json.push_back({{"t_s", b.t_s}, {"mean", b.mean}, {"min", b.min}, {"max", b.max}});
  return json;
}

template <typename T>
Json Optional(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

const char* VerdictName(Verdict verdict) {
  return verdict == Verdict::kGood ? "good" : verdict == Verdict::kLook ? "look" : "bad";
}

}  // namespace

std::vector<Judgement> Judge(const SessionReview& review) {
  std::vector<Judgement> list{Wholeness(review)};
  if (review.state.torn)
    list.push_back({Verdict::kLook,
                    "The journal's last line is unfinished: what a crash leaves; a resumed capture "
                    "drops it."});
  JudgeEpochs(review, list);
  JudgeFrames(review, list);
  JudgeLamp(review, list);
  JudgeBench(review, list);
  if (review.edges)
    for (std::string& warning : EdgeWarnings(review.edges->light, review.edges->grid))
      list.push_back({Verdict::kLook, std::move(warning)});
  list.push_back(Files(review));
  std::stable_sort(list.begin(), list.end(), [](const Judgement& a, const Judgement& b) {
    return static_cast<int>(a.verdict) > static_cast<int>(b.verdict);
  });
  return list;
}

Json ToJson(const SessionReview& r) {
  Json json = {
      {"name", r.plan.name},
      {"kind", r.plan.kind},
      {"plan_id", r.plan.id},
      {"sealed", r.state.sealed},
      {"torn", r.state.torn},
      {"in_use", r.state.in_use},
      {"planned_positions", r.plan.positions},
      {"missing", r.counts.missing},
      {"frames", r.counts.frames},
      {"superseded", r.counts.superseded},
      {"flagged", r.counts.flagged},
      {"rejected", r.counts.rejected},
      {"rejected_elsewhere", r.counts.rejected_elsewhere},
      {"probes", r.counts.probes},
      {"bytes", r.counts.bytes},
      {"files_missing", r.counts.files_missing},
      {"files_other_size", r.counts.files_other_size},
      {"duration_s", r.duration_s},
      {"max_drift", Optional(r.plan.max_drift)},
      {"pulses", r.lamp.pulses ? Json{{"hz", r.lamp.pulses->hz},
                                      {"sigma_hz", r.lamp.pulses->sigma_hz},
                                      {"whole_periods_of_hz", r.lamp.pulses->whole_periods_of_hz}}
                               : Json()},
      {"suspended_ratio", SeriesJson(r.lamp.suspended_ratio)},
      {"meter_ratio", SeriesJson(r.lamp.meter_ratio)},
      {"reference_over_meter", SeriesJson(r.lamp.reference_over_meter)},
      {"temperature_c", SeriesJson(r.sensor.temperature_c)},
      {"dark_exposure_s", r.sensor.dark_exposure_s},
      {"dark_dn", SeriesJson(r.sensor.dark_dn)},
      {"voltage_v", SeriesJson(r.lamp.voltage_v)},
      {"current_a", SeriesJson(r.lamp.current_a)},
      {"devices", r.setup.devices},
      {"software", r.setup.software}};
  if (r.edges) json["edges"] = ToJson(r.edges->light).at("sides");
  for (const Judgement& judgement : Judge(r))
    json["verdict"].push_back(
        {{"verdict", VerdictName(judgement.verdict)}, {"text", judgement.text}});
  json["epochs"] = Json::array();
  for (const ReviewedEpoch& e : r.epochs)
    json["epochs"].push_back({{"epoch", e.number},
                              {"begin_s", e.begin_s},
                              {"end_s", e.end_s},
                              {"utc", e.utc},
                              {"frames", e.frames},
                              {"paused", e.paused},
                              {"suspended", e.suspended},
                              {"sealed", e.sealed},
                              {"devices", e.devices}});
  json["events"] = Json::array();
  for (const SessionEvent& e : r.events)
    json["events"].push_back({{"t_s", e.t_s}, {"utc", e.utc}, {"what", e.what}});
  json["references"] = Json::array();
  for (const auto& [channel, ratio] : r.lamp.reference_ratio)
    for (const TimedValue& v : ratio)
      json["references"].push_back({{"channel", channel}, {"t_s", v.t_s}, {"ratio", v.value}});
  json["exposures"] = Json::array();
  for (const ReviewedExposure& e : r.exposures)
    json["exposures"].push_back({{"exposure_s", e.exposure_s},
                                 {"frames", e.frames},
                                 {"flagged", e.flagged},
                                 {"brightest_min_median_max", Optional(e.brightest)},
                                 {"mean", Optional(e.mean)},
                                 {"saturated_share", e.saturated_share},
                                 {"black_share", e.black_share}});
  json["positions"] = Json::array();
  for (const ReviewedPosition& p : r.positions)
    json["positions"].push_back({{"i", p.i},
                                 {"j", p.j},
                                 {"whole", p.whole},
                                 {"frames", p.frames},
                                 {"rejected", p.rejected},
                                 {"flagged", p.flagged},
                                 {"saturated_share", Optional(p.saturated_share)},
                                 {"black_share", Optional(p.black_share)},
                                 {"residual_m", Optional(p.residual_m)}});
  json["reasons"] = Json::array();
  for (const RejectedReason& reason : r.reasons)
    json["reasons"].push_back(
        {{"reason", reason.reason}, {"example", reason.example}, {"frames", reason.frames}});
  if (r.check)
    json["verify"] = {{"frames", r.check->frames},
                      {"positions", r.check->positions},
                      {"problems", r.check->problems}};
  return json;
}

}  // namespace luxfield::capture
