// The lines a fake Grbl controller executes: system commands and the G-code a stage needs.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "tests/fakes/grbl_machine.h"

namespace luxfield::fakes {
namespace {

constexpr std::size_t kLineBytes = 79;
// Response numbers (doc/csv/error_codes_en_US.csv).
constexpr int kOk = 0, kPending = -1, kNoLetter = 1, kBadNumber = 2, kNotRecognised = 3,
              kHomingOff = 5, kNotIdle = 8, kLocked = 9, kSoftLimitNeedsHoming = 10,
              kLineTooLong = 11, kUnsupported = 20, kModalGroup = 21, kNoFeed = 22,
              kRepeatedWord = 25, kNoAxes = 26, kMissingValue = 28, kUnusedWords = 36;
const std::set<int> kOfFluidNc = {10, 13, 20, 21, 22, 23, 30, 32};  // settings below 100 it tells

bool ReadNumber(std::string_view& text, double& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

// Spaces and comments are dropped and letters raised while characters come in; not in FluidNC's
// system commands, which have paths.
void GrblMachine::ReadLines() {
  std::size_t used = 0;
  while (used < input_.size() && task_ == Task::kReadLines && !reset_ && alarm_ == 0) {
    const char c = input_[used++];
    if (c != '\n' && c != '\r') {
      const bool path = kind_ == GrblKind::kFluidNc && line_.starts_with('$');
      if (c <= ' ' || (c == '/' && !path)) continue;
      if (line_.size() < kLineBytes)
        line_ += path ? c : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
      else
        line_overflow_ = true;
      continue;
    }
    const std::string line = std::exchange(line_, {});
    const bool overflow = std::exchange(line_overflow_, false);
    const int response = overflow ? kLineTooLong : Execute(line);
    if (response != kPending) Finish(response);
    break;  // one line a slice, so that real-time commands come in between
  }
  input_.erase(0, used);
}

int GrblMachine::Execute(const std::string& line) {
  if (line.empty()) return kOk;
  if (line.front() == '$') return ExecuteSystem(line.substr(1));
  if (state_ == State::kAlarm) return kLocked;
  return ExecuteBlock(line);
}

int GrblMachine::ExecuteSystem(const std::string& command) {
  if (command.empty()) {
    Say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]");
    return kOk;
  }
  if (command == "$") {
    if (state_ == State::kRun) return kNotIdle;
    for (const auto& [number, value] : settings_) {
      if (kind_ == GrblKind::kFluidNc && number < 100 && !kOfFluidNc.contains(number)) continue;
      const bool whole = number < 11 || number == 13 || (number >= 20 && number <= 23) ||
                         number == 26 || (number >= 30 && number <= 32);
      Say(whole ? fmt::format("${}={:.0f}", number, value)
                : fmt::format("${}={:.3f}", number, value));
    }
    return kOk;
  }
  if (command == "G") {
    Say(fmt::format("[GC:G{} G54 G17 G{} G{} G94 M5 M9 T0 F{:.0f} S0]", rapid_ ? 0 : 1,
                    inches_ ? 20 : 21, incremental_ ? 91 : 90, feed_));
    return kOk;
  }
  if (command == "X") {
    if (state_ != State::kAlarm) return kOk;
    Say("[MSG:Caution: Unlocked]");
    state_ = State::kIdle;
    return kOk;
  }
  if (state_ != State::kIdle && state_ != State::kAlarm) return kNotIdle;
  if (command == "I") {
    SayIdentity();
    return kOk;
  }
  if (kind_ == GrblKind::kFluidNc && command.starts_with('/')) return ReportItem(command);
  if (command == "H") {
    if (Set(22) == 0) return kHomingOff;
    state_ = State::kHome;
    task_ = Task::kHoming;
    homing_phase_ = 0;
    homing_way_ = {};
    homing_done_ = {};
    wait_s_ = 0;
    return kPending;
  }
  std::string_view rest = command;
  double number = 0, value = 0;
  if (!ReadNumber(rest, number)) return kBadNumber;
  if (!rest.starts_with('=')) return kNotRecognised;
  rest.remove_prefix(1);
  if (!ReadNumber(rest, value)) return kBadNumber;
  const auto setting = settings_.find(static_cast<int>(number));
  if (!rest.empty() || setting == settings_.end()) return kNotRecognised;
  if (setting->first == 20 && value != 0 && Set(22) == 0) return kSoftLimitNeedsHoming;
  setting->second = value;
  return kOk;
}

// An item of FluidNC's configuration, "/axes/x/soft_limits".
int GrblMachine::ReportItem(const std::string& name) {
  for (const char axis : {'x', 'y'}) {
    const std::string path = fmt::format("/axes/{}/", axis);
    if (name == path + "homing/mpos_mm")
      Say(fmt::format("${}={:.3f}", name, kFluidNcHome_mm));
    else if (name == path + "soft_limits")
      Say(fmt::format("${}={}", name, Set(20) != 0));
    else
      continue;
    return kOk;
  }
  return kNotRecognised;
}

int GrblMachine::ExecuteBlock(const std::string& line) {
  std::map<char, double> words;
  std::vector<int> commands;
  for (std::string_view rest = line; !rest.empty();) {
    const char letter = rest.front();
    double value = 0;
    if (letter < 'A' || letter > 'Z') return kNoLetter;
    rest.remove_prefix(1);
    if (!ReadNumber(rest, value)) return kBadNumber;
    if (letter == 'G')
      commands.push_back(static_cast<int>(std::lround(10 * value)));
    else if (!words.emplace(letter, value).second)
      return kRepeatedWord;
  }

  bool inches = inches_, incremental = incremental_, rapid = rapid_;
  bool machine_frame = false, dwell = false;
  int motions = 0;
  for (const int command : commands) switch (command) {
      case 0:
      case 10:
        rapid = command == 0;
        ++motions;
        break;
      case 40:
        dwell = true;
        break;
      case 200:
      case 210:
        inches = command == 200;
        break;
      case 530:
        machine_frame = true;
        break;
      case 540:
      case 940:
        break;
      case 900:
      case 910:
        incremental = command == 910;
        break;
      default:
        return kUnsupported;
    }
  if (motions > 1) return kModalGroup;

  const double unit_mm = inches ? 25.4 : 1;
  double feed = feed_;
  if (const auto f = words.extract('F')) feed = f.mapped() * unit_mm;
  double dwell_s = 0;
  if (dwell) {
    const auto p = words.extract('P');
    if (!p) return kMissingValue;
    dwell_s = p.mapped();
  }
  GrblMotion::Block move{motion_.End(), 0};
  bool has_axes = false;
  for (int axis = 0; axis < 3; ++axis)
    if (const auto word = words.extract("XYZ"[axis])) {
      const double value = word.mapped() * unit_mm;
      // The work coordinate system coincides with the machine's.
      move.target[axis] = incremental && !machine_frame ? move.target[axis] + value : value;
      has_axes = true;
    }
  if (!words.empty()) return kUnusedWords;
  if (motions > 0 && machine_frame && !has_axes) return kNoAxes;
  if (has_axes && !rapid && feed <= 0) return kNoFeed;

  inches_ = inches;
  incremental_ = incremental;
  rapid_ = rapid;
  feed_ = feed;
  if (dwell) {
    wait_s_ = dwell_s;
    task_ = Task::kWaitForMoves;
    return kPending;
  }
  if (!has_axes) return kOk;
  move.rate = std::min(Set(110), Set(111)) / 60;
  if (!rapid) move.rate = std::min(move.rate, feed / 60);
  return PlanMove(move);
}

int GrblMachine::PlanMove(const GrblMotion::Block& block) {
  bool outside = false;
  for (int axis = 0; axis < 3; ++axis) {
    const bool from_home = kind_ == GrblKind::kFluidNc;
    const double high = !from_home ? 0 : HomeMm(axis) + (HomesLow(axis) ? Set(130 + axis) : 0);
    outside = outside || block.target[axis] > high || block.target[axis] < high - Set(130 + axis);
  }
  if (Set(20) != 0 && outside) {
    // Comes to rest first, so that the position is kept.
    if (state_ == State::kRun) state_ = State::kHold;
    task_ = Task::kBrakeForSoftLimit;
    return kPending;
  }
  if (motion_.full()) {
    waiting_move_ = block;
    task_ = Task::kWaitForRoom;
    return kPending;
  }
  motion_.Add(block);
  return kOk;
}

}  // namespace luxfield::fakes
