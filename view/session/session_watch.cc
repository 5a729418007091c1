#include "luxfield/view/session/session_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "luxfield/core/json.h"
#include "luxfield/session/journal.h"
#include "luxfield/session/plan_json.h"

namespace luxfield::view {
namespace {

using core::Json;

constexpr char kPlan[] = "plan.json", kJournal[] = "journal.jsonl";

template <typename T>
std::optional<T> Optional(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end()) return {};
  if constexpr (std::is_same_v<T, std::string>) {
    if (!found->is_string()) return {};
  } else if constexpr (std::is_same_v<T, bool>) {
    if (!found->is_boolean()) return {};
  } else {
    if (!found->is_number()) return {};
  }
  return found->get<T>();
}

int IntOf(const Json& json, const char* key, int fallback) {
  return Optional<int>(json, key).value_or(fallback);
}

}  // namespace

int WatchedSession::Count(PositionState state) const {
  return static_cast<int>(std::ranges::count(positions, state, &WatchedPosition::state));
}

bool SessionWatch::IsThere(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / kPlan) && std::filesystem::exists(folder / kJournal);
}

SessionWatch::SessionWatch(std::filesystem::path folder)
    : folder_(std::move(folder)), journal_(folder_ / kJournal) {
  const auto plan = folder_ / kPlan;
  plan_ = session::PlanFromJson(core::ReadJson(plan), plan.string());
  if (!std::filesystem::exists(journal_))
    throw InputError(journal_.string(), "is not there", "name the folder of a capture");
  Begin();
  Update();
}

void SessionWatch::Begin() {
  session_ = {};
  session_.kind = plan_.kind;
  session_.name = plan_.name;
  place_.clear();
  if (plan_.positions)
    for (const auto& position : *plan_.positions) {
      place_[{position.i, position.j}] = session_.positions.size();
      session_.positions.push_back({position.i, position.j});
    }
  read_bytes_ = 0;
  lines_ = 0;
  flags_.clear();
  completed_in_epoch_ = 0;
}

bool SessionWatch::Update() {
  const std::uint64_t size = std::filesystem::file_size(journal_);
  if (size < read_bytes_) Begin();
  if (size == read_bytes_) return false;
  std::ifstream file(journal_, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(read_bytes_));
  std::string bytes(size - read_bytes_, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  bool news = false;
  std::size_t begin = 0;
  for (std::size_t end; (end = bytes.find('\n', begin)) != std::string::npos; begin = end + 1) {
    Json record;
    ++lines_;
    if (!session::ParseJournalLine(std::string_view(bytes).substr(begin, end - begin), record))
      throw InputError(journal_.string(), fmt::format("line {} is damaged", lines_),
                       "see `luxfield verify`");
    See(record);
    news = true;
  }
  read_bytes_ += begin;
  Estimate();
  return news;
}

WatchedPosition* SessionWatch::At(int i, int j) {
  const auto found = place_.find({i, j});
  return found == place_.end() ? nullptr : &session_.positions[found->second];
}

// A new epoch takes brackets from their beginning.
void SessionWatch::ForgetUnfinished() {
  for (WatchedPosition& position : session_.positions)
    if (position.state == PositionState::kExposing) position.state = PositionState::kWaiting;
  flags_.clear();
}

void SessionWatch::SeeFrame(const Json& record) {
  ++session_.frames;
  const bool flagged = Optional<bool>(record, "flagged").value_or(false);
  session_.flagged += flagged;
  const Json checks = record.value("checks", Json::object());
  session_.last_frame = WatchedFrame{
      Optional<std::string>(record, "file").value_or(""),
      Optional<double>(record, "exposure_s").value_or(0), Optional<double>(checks, "mean_dn"),
      Optional<double>(checks, "brightest_dn"), Optional<double>(checks, "saturated_share")};
  if (const auto temperature = Optional<double>(checks, "temperature_c"))
    session_.temperature_c.push_back({Optional<double>(record, "t_s").value_or(0), *temperature});
  if (Optional<std::string>(record, "kind") != "position") return;
  const int i = IntOf(record, "i", -1), j = IntOf(record, "j", -1);
  WatchedPosition* position = At(i, j);
  if (!position) return;
  position->state = PositionState::kExposing;
  flags_[{i, j}] |= flagged;
}

void SessionWatch::SeeComplete(const Json& record) {
  const int i = IntOf(record, "i", -1), j = IntOf(record, "j", -1);
  WatchedPosition* position = At(i, j);
  if (!position) return;
  position->state = flags_[{i, j}] ? PositionState::kFlagged : PositionState::kDone;
  position->retake = false;
  flags_.erase({i, j});
  ++completed_in_epoch_;
  last_complete_s_ = Optional<double>(record, "t_s").value_or(0);
}

void SessionWatch::See(const Json& record) {
  const std::string type = Optional<std::string>(record, "type").value_or("");
  const double t_s = Optional<double>(record, "t_s").value_or(0);
  session_.utc = Optional<std::string>(record, "utc").value_or("");
  if (type == "frame") {
    SeeFrame(record);
  } else if (type == "frame_rejected") {
    ++session_.rejected;
    if (WatchedPosition* position = At(IntOf(record, "i", -1), IntOf(record, "j", -1)))
      ++position->rejected;
  } else if (type == "position_complete") {
    SeeComplete(record);
  } else if (type == "epoch_start") {
    ForgetUnfinished();
    session_.epochs = IntOf(record, "epoch", session_.epochs) + 1;
    session_.suspended = session_.paused = false;
    epoch_begin_s_ = t_s;
    completed_in_epoch_ = 0;
  } else if (type == "reference" && IntOf(record, "channel", 0) == 0) {
    if (const auto ratio = Optional<double>(record, "ratio"))
      session_.drift.push_back({t_s, *ratio});
  } else if (type == "suspended") {
    session_.suspended = true;
    for (const Json& place : record.value("retake", Json::array())) {
      if (!place.is_array() || place.size() != 2 || !place[0].is_number_integer() ||
          !place[1].is_number_integer())
        continue;
      if (WatchedPosition* position = At(place[0].get<int>(), place[1].get<int>())) {
        position->state = PositionState::kWaiting;
        position->retake = true;
      }
    }
  } else if (type == "paused") {
    session_.paused = true;
  } else if (type == "sealed") {
    session_.sealed = true;
  }
}

void SessionWatch::Estimate() {
  session_.eta_s.reset();
  const int left =
      session_.Count(PositionState::kWaiting) + session_.Count(PositionState::kExposing);
  if (session_.sealed || left == 0 || completed_in_epoch_ == 0) return;
  session_.eta_s = left * (last_complete_s_ - epoch_begin_s_) / completed_in_epoch_;
}

}  // namespace luxfield::view
