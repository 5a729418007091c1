// A session as it fills: what its plan asks for and its journal says, read while a capture writes it.
//
// Nothing but plan.json and journal.jsonl is read here, no lock is taken and nothing is written, so that a
// capture is not disturbed. A line is read when it is whole; the file is followed from where it ended
// before.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/session/plan_file.h"

namespace luxfield::view {

enum class PositionState {
  kWaiting,
  kExposing,  // frames of its bracket are there, and it is not finished
  kDone,
  kFlagged  // done, with a frame that was kept although a check failed
};

struct WatchedPosition {
  int i = 0, j = 0;
  PositionState state = PositionState::kWaiting;
  int rejected = 0;     // frames that were taken, found wrong and taken again
  bool retake = false;  // a drift made the bracket doubtful: it is waiting again
};

struct WatchedValue {
  double t_s = 0, value = 0;  // the rig's clock
};

struct WatchedFrame {
  std::string file;
  double exposure_s = 0;
  std::optional<double> mean_dn, brightest_dn, saturated_share;
};

struct WatchedSession {
  session::PlanKind kind = session::PlanKind::kLightField;
  std::string name;
  std::vector<WatchedPosition> positions;  // in the plan's order; light fields only
  int frames = 0, flagged = 0, rejected = 0, epochs = 0;
  bool sealed = false, suspended = false, paused = false;
  std::string utc;  // of the last line
  std::optional<WatchedFrame> last_frame;
  std::vector<WatchedValue> drift;          // references of channel 0 over the first
  std::vector<WatchedValue> temperature_c;  // of the sensor
  // Time until the last position, as long as those of this epoch took on average; empty before the
  // first is finished, and when nothing is left.
  std::optional<double> eta_s;

  int Count(PositionState state) const;
};

class SessionWatch {
 public:
  // Whether a folder holds what the constructor reads.
  static bool IsThere(const std::filesystem::path& folder);
  // Throws InputError for a folder without a readable plan.json or journal.jsonl.
  explicit SessionWatch(std::filesystem::path folder);

  // Reads what was appended; whether that was anything. Throws InputError naming the line for a line
  // that is whole and damaged; a journal that became shorter is read anew.
  bool Update();
  const WatchedSession& session() const { return session_; }

 private:
  void Begin();
  void See(const nlohmann::json& record);
  void SeeFrame(const nlohmann::json& record);
  void SeeComplete(const nlohmann::json& record);
  void ForgetUnfinished();
  void Estimate();
  WatchedPosition* At(int i, int j);

  std::filesystem::path folder_, journal_;
  session::PlanFile plan_;
  WatchedSession session_;
  std::map<std::pair<int, int>, std::size_t> place_;
  std::uint64_t read_bytes_ = 0;
  std::size_t lines_ = 0;
  std::map<std::pair<int, int>, bool> flags_;  // of the bracket that is being taken
  double epoch_begin_s_ = 0, last_complete_s_ = 0;
  int completed_in_epoch_ = 0;
};

}  // namespace luxfield::view
