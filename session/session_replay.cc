#include "luxfield/session/session_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

#include "luxfield/core/json.h"
#include "luxfield/session/session_path.h"

namespace luxfield::session {
namespace {

constexpr std::array kKindNames = {"position", "dark", "flat", "reference", "target"};
constexpr std::array kKindFolders = {"frames", "darks", "flats", "refs", "targets"};
constexpr const char* kRemedy = "run `luxfield verify --salvage` on the session";

// What a capture can have: exposures of a nanosecond to a week, stages as large as a building,
// meters of any unit.
constexpr core::Range kExposure_s{1e-9, 604800}, kStage_m{-100, 100}, kTime_s{-1e11, 1e11},
    kAttenuation{1e-12, 1e12}, kMeter{0, 1e15};

FrameKind KindFromName(const std::string& name, const std::string& where) {
  for (std::size_t k = 0; k < kKindNames.size(); ++k)
    if (name == kKindNames[k]) return static_cast<FrameKind>(k);
  throw InputError(where, fmt::format("kind = \"{}\" is not a frame kind", name), kRemedy);
}

}  // namespace

std::string FrameKindName(FrameKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }
std::string FrameKindFolder(FrameKind kind) { return kKindFolders[static_cast<std::size_t>(kind)]; }

core::Json FrameToJson(const FrameRecord& r) {
  return {{"kind", FrameKindName(r.kind)},
          {"i", r.i},
          {"j", r.j},
          {"channel", r.channel},
          {"print", r.print},
          {"exposure_index", r.exposure_index},
          {"repeat", r.repeat},
          {"attempt", r.attempt},
          {"epoch", r.epoch},
          {"requested_exposure_s", r.requested_exposure_s},
          {"exposure_s", r.exposure_s},
          {"attenuation", r.attenuation},
          {"stage_u_m", r.stage_u_m},
          {"stage_v_m", r.stage_v_m},
          {"t_start_s", r.t_start_s},
          {"meter", r.meter},
          {"flagged", r.flagged},
          {"file", r.file},
          {"sha256", r.sha256}};
}

FrameRecord FrameFromJson(const core::Json& json, const std::string& where) {
  FrameRecord r;
  r.kind = KindFromName(core::Field<std::string>(json, "kind", where), where);
  r.i = core::Field<int>(json, "i", where);
  r.j = core::Field<int>(json, "j", where);
  r.channel = core::Field<int>(json, "channel", where);
  r.print = core::Field<int>(json, "print", where);
  r.exposure_index = core::Field<int>(json, "exposure_index", where);
  r.repeat = core::Field<int>(json, "repeat", where);
  r.attempt = core::Field<int>(json, "attempt", where);
  r.epoch = core::Field<int>(json, "epoch", where);
  const auto number = [&](const char* key, core::Range range) {
    return core::NumberField(json, key, where, range, kRemedy);
  };
  r.requested_exposure_s = number("requested_exposure_s", {0, kExposure_s.max});
  r.exposure_s = number("exposure_s", kExposure_s);
  r.attenuation = number("attenuation", kAttenuation);
  r.stage_u_m = number("stage_u_m", kStage_m);
  r.stage_v_m = number("stage_v_m", kStage_m);
  r.t_start_s = number("t_start_s", kTime_s);
  r.meter = number("meter", kMeter);
  r.flagged = core::Field<bool>(json, "flagged", where);
  r.file = core::Field<std::string>(json, "file", where);
  r.sha256 = core::Field<std::string>(json, "sha256", where);
  CheckSessionFileName(r.file, where);
  const auto require = [&](bool good, const char* field, double value) {
    if (!good)
      throw InputError(where, fmt::format("{} = {} makes no sense", field, value), kRemedy);
  };
  require(r.channel >= 0 && r.channel < 3, "channel", r.channel);
  require(r.print == 0 || r.print == 1, "print", r.print);
  require(r.exposure_index >= 0, "exposure_index", r.exposure_index);
  require(r.repeat >= 0, "repeat", r.repeat);
  require(r.attempt >= 0, "attempt", r.attempt);
  require(r.epoch >= 0, "epoch", r.epoch);
  if (r.kind == FrameKind::kPosition) {
    require(r.i >= 0, "i", r.i);
    require(r.j >= 0, "j", r.j);
  }
  return r;
}

int SessionState::BracketEpoch(int i, int j) const {
  int epoch = -1;
  for (const Bracket& bracket : brackets) {
    if (bracket.i != i || bracket.j != j || bracket.epoch < epoch) continue;
    const auto count = std::count_if(committed.begin(), committed.end(), [&](const FrameRecord& r) {
      return r.kind == FrameKind::kPosition && r.i == i && r.j == j && r.epoch == bracket.epoch;
    });
    if (count == bracket.frames) epoch = bracket.epoch;
  }
  return epoch;
}

void SessionState::Discard(const std::vector<std::pair<int, int>>& positions) {
  std::erase_if(brackets, [&](const Bracket& bracket) {
    return std::find(positions.begin(), positions.end(), std::pair(bracket.i, bracket.j)) !=
           positions.end();
  });
  since_reference.clear();
}

std::vector<FrameRecord> SessionState::UsableFrames() const {
  // Whole brackets, as BracketEpoch has it, for all positions in one pass.
  std::map<std::tuple<int, int, int>, int> counts;
  for (const FrameRecord& r : committed)
    if (r.kind == FrameKind::kPosition) ++counts[{r.i, r.j, r.epoch}];
  std::map<std::pair<int, int>, int> epochs;
  for (const Bracket& b : brackets)
    if (counts[{b.i, b.j, b.epoch}] == b.frames) {
      auto& epoch = epochs.try_emplace({b.i, b.j}, b.epoch).first->second;
      epoch = std::max(epoch, b.epoch);
    }
  std::vector<FrameRecord> usable;
  std::map<std::tuple<int, int, int, int, int, int, int, int>, std::size_t>
      place;  // planned frame -> index in usable
  for (const FrameRecord& r : committed) {
    if (r.kind == FrameKind::kPosition) {
      const auto found = epochs.find({r.i, r.j});
      if (found == epochs.end() || found->second != r.epoch) continue;
    }
    const auto [slot, added] =
        place.try_emplace({static_cast<int>(r.kind), r.i, r.j, r.channel, r.print, r.exposure_index,
                           r.repeat, r.kind == FrameKind::kPosition ? 0 : r.epoch},
                          usable.size());
    if (added)
      usable.push_back(r);
    else  // the journal is in the order in which frames were taken
      usable[slot->second] = r;
  }
  return usable;
}

void ReplayRecord(const core::Json& record, std::size_t line, const std::string& file,
                  SessionState& state) {
  const std::string where = fmt::format("{} line {}", file, line);
  const auto type = core::Field<std::string>(record, "type", where);
  if ((line == 1) != (type == "session_open"))
    throw InputError(
        where, fmt::format("a journal begins with its one session_open record, this is {}", type),
        kRemedy);
  if (type == "session_open") {
    state.plan_sha256 = core::Field<std::string>(record, "plan_sha256", where);
    state.session_sha256 = core::Field<std::string>(record, "session_sha256", where);
    for (const auto& [name, sha256] :
         core::Field<std::map<std::string, std::string>>(record, "files", where)) {
      CheckSessionFileName(name, where);
      state.other_files.emplace_back(name, sha256);
    }
  } else if (type == "epoch_start") {
    state.last_epoch = core::Field<int>(record, "epoch", where);
  } else if (type == "frame") {
    state.committed.push_back(FrameFromJson(record, where));
  } else if (type == "position_complete") {
    state.brackets.push_back(
        {core::Field<int>(record, "i", where), core::Field<int>(record, "j", where),
         core::Field<int>(record, "epoch", where), core::Field<int>(record, "frames", where)});
    state.since_reference.emplace_back(state.brackets.back().i, state.brackets.back().j);
  } else if (type == "suspended") {
    state.Discard(core::Field<std::vector<std::pair<int, int>>>(record, "retake", where));
  } else if (type == "reference") {
    state.since_reference.clear();
    state.first_reference_rates.try_emplace(core::Field<int>(record, "channel", where),
                                            core::Field<double>(record, "mean_rate", where));
  } else if (type == "sealed") {
    state.sealed = true;
  }
}

void RequireReadable(const std::string& type, const core::Json& fields, std::size_t line,
                     const std::string& file) {
  const std::string what = fmt::format("{} line {} ({})", file, line, type);
  const auto refuse = [&](const std::string& problem) {
    throw DeviceError(
        fmt::format("{}: {}, which no reader would take; nothing of it is written, the session can "
                    "be resumed",
                    what, problem));
  };
  const std::function<void(const core::Json&, const std::string&)> look =
      [&](const core::Json& value, const std::string& name) {
        if (value.is_number_float() && !std::isfinite(value.get<double>()))
          refuse(fmt::format("{} = {} is no finite number", name, value.get<double>()));
        if (value.is_structured())
          for (const auto& [key, part] : value.items()) look(part, name + "." + key);
      };
  for (const auto& [key, value] : fields.items()) look(value, key);
  core::Json record = fields;
  record["type"] = type;
  SessionState nothing;
  try {
    ReplayRecord(record, line, file, nothing);
  } catch (const InputError& error) {
    refuse(error.what());
  }
}

SessionState ReplayJournal(const std::vector<core::Json>& records, const std::string& file) {
  SessionState state;
  for (std::size_t n = 0; n < records.size(); ++n) ReplayRecord(records[n], n + 1, file, state);
  return state;
}

}  // namespace luxfield::session
