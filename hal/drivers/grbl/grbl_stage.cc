#include "luxfield/hal/drivers/grbl/grbl_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "luxfield/hal/drivers/grbl/codes.h"

namespace luxfield::hal::grbl {
namespace {

constexpr char kStatusQuery = '?', kFeedHold = '!', kReset = 0x18;

constexpr double kConnect_s = 5;     // a board that restarts on opening takes two
constexpr double kAnswer_s = 1;      // before a status report is asked for again
constexpr double kSilence_s = 2;     // no report at all; a slow line takes one
constexpr double kQuestion_s = 0.2;  // between questions: at most 5 a second
constexpr double kLook_s = 0.02;     // between looks at a stop from another thread
constexpr int kPatience = 5;         // reports of standing elsewhere before that is believed

SteadyTime Now() { return std::chrono::steady_clock::now(); }

bool IsMoving(const Status& status) {
  switch (status.state) {
    case State::kRun:
    case State::kJog:
    case State::kHome:
      return true;
    case State::kHold:
      return status.substate != 0;
    case State::kDoor:
      return status.substate > 1;
    default:
      return false;
  }
}

}  // namespace

GrblStage::GrblStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
                     std::shared_ptr<core::Clock> clock)
    : ControllerStage(setup.limits, std::move(clock)),
      stream_(std::move(stream)),
      reader_(*stream_),
      axes_(setup.axes),
      feed_mm_per_min_(setup.limits.speed_m_per_s * 60000),
      identity_("Grbl stage on " + stream_->name()) {
  Connect(kConnect_s, [&](const Operation& connect) {
    for (const Message& message : Command(connect, "$I"))
      if (const auto* info = std::get_if<Feedback>(&message)) controller_.ReadInfo(info->text);
    for (const Message& message : Command(connect, "$$"))
      if (const auto* setting = std::get_if<Setting>(&message))
        controller_.settings[setting->number] = setting->value;
    if (controller_.firmware.name == "FluidNC") LearnFluidNc(connect);
    CheckController(controller_, setup, identity_);
  });
  identity_ = fmt::format("{} {} stage on {}", controller_.firmware.name,
                          controller_.firmware.version, stream_->name());
  SetResolution(1e-3 * std::max(controller_.StepMm(axes_[0].machine_axis, identity_),
                                controller_.StepMm(axes_[1].machine_axis, identity_)));
}

void GrblStage::SendStop(bool homing, SteadyTime deadline) {
  SendRealtime(homing ? kReset : kFeedHold, deadline);
}

void GrblStage::SendRealtime(char command, SteadyTime deadline) {
  stream_->Write({&command, 1}, deadline);
}

// One message, or nothing by `until` or the deadline. Alarms and restarts end the operation.
std::optional<Message> GrblStage::Listen(const Operation& operation, SteadyTime until) {
  const auto line = reader_.Next(std::min(until, operation.deadline));
  if (!line) return {};
  Message message = ParseMessage(*line);
  if (const auto* alarm = std::get_if<Alarm>(&message)) {
    const Meaning meaning = AlarmMeaning(alarm->code, controller_.firmware.name);
    // Said after every start until it is homed, which is no news before.
    if (meaning.fault == Fault::kNotHomed && !homed() && !homing()) return message;
    throw Failure(operation, stop_requested() ? Fault::kStopped : meaning.fault,
                  fmt::format("ALARM:{}, {}", alarm->code, meaning.problem),
                  std::string(meaning.remedy), true);
  }
  if (std::holds_alternative<Welcome>(message))
    throw Failure(operation, stop_requested() ? Fault::kStopped : Fault::kNotHomed,
                  "the controller has restarted", "check its power and reset button, then home",
                  true);
  if (const auto* status = std::get_if<Status>(&message)) Remember(*status);
  return message;
}

// Sends a line and waits for its response; returns what was pushed meanwhile.
std::vector<Message> GrblStage::Command(const Operation& operation, const std::string& line) {
  while (Listen(operation, Now())) {
  }  // answers that came too late belong to nobody
  stream_->Write(line + "\n", operation.deadline);
  std::vector<Message> pushed;
  SteadyTime question = SecondsFromNow(kQuestion_s);
  for (;;) {
    ThrowIfStopped(operation);
    auto message = Listen(operation, SecondsFromNow(kLook_s));
    if (!message) {
      if (Now() >= operation.deadline)
        throw Failure(operation, Fault::kTimeout, fmt::format("no answer to {}", line),
                      "check power and cable, then home");
      if (Now() >= question) {
        SendRealtime(kStatusQuery, operation.deadline);
        question = SecondsFromNow(kQuestion_s);
      }
      continue;
    }
    if (std::holds_alternative<Ok>(*message)) return pushed;
    if (const auto* error = std::get_if<ErrorReply>(&*message)) {
      const Meaning meaning = ErrorMeaning(error->code);
      throw Failure(operation, meaning.fault,
                    fmt::format("error:{} to {}, {}", error->code, line, meaning.problem),
                    std::string(meaning.remedy));
    }
    if (const auto* status = std::get_if<Status>(&*message)) CheckUndisturbed(operation, *status);
    pushed.push_back(std::move(*message));
  }
}

// What $n do not say: FluidNC's $20 is that of X, and homing leaves an axis at its mpos_mm.
void GrblStage::LearnFluidNc(const Operation& operation) {
  for (const Axis& axis : axes_) {
    const std::string path = fmt::format("$/axes/{}/", "xyz"[axis.machine_axis]);
    const std::string home = AskItem(operation, path + "homing/mpos_mm");
    controller_.own_home_mm[axis.machine_axis] = std::strtod(home.c_str(), nullptr);
    if (AskItem(operation, path + "soft_limits") != "true") controller_.settings[kSoftLimits] = 0;
  }
}

// An item of FluidNC's configuration.
std::string GrblStage::AskItem(const Operation& operation, const std::string& name) {
  const std::string start = name + "=";
  for (const Message& message : Command(operation, name))
    if (const auto* line = std::get_if<Other>(&message); line && line->text.starts_with(start))
      return line->text.substr(start.size());
  throw Failure(operation, Fault::kProtocol, name + " did not come through",
                "check cable and firmware");
}

// The next report of a position that can be told.
Status GrblStage::AskStatus(const Operation& operation) {
  for (;;) {
    SendRealtime(kStatusQuery, operation.deadline);
    const SteadyTime again = SecondsFromNow(kAnswer_s);
    while (const auto message = Listen(operation, again))
      if (const auto* status = std::get_if<Status>(&*message); status && MachineMm(*status))
        return *status;
    if (Now() >= operation.deadline)
      throw Failure(operation, Fault::kTimeout, "no status report",
                    "check power and cable, then home");
  }
}

// Brings machine and controller to rest: feed hold, the wait for its end, reset, welcome. Where no
// report comes (critical alarm, homing, silence) the reset comes after two seconds.
bool GrblStage::Halt(const Operation& operation) {
  bool kept = true;
  const auto hear = [&](SteadyTime until) -> std::optional<Message> {
    const auto line = reader_.Next(std::min(until, operation.deadline));
    if (!line) return {};
    Message message = ParseMessage(*line);
    if (std::holds_alternative<Alarm>(message) || std::holds_alternative<Welcome>(message))
      kept = false;
    if (const auto* welcome = std::get_if<Welcome>(&message))
      controller_.firmware = welcome->firmware;
    return message;
  };
  const auto ask = [&] {  // again, in case a byte was lost
    SendRealtime(kFeedHold, operation.deadline);
    SendRealtime(kStatusQuery, operation.deadline);
  };
  ask();
  SteadyTime silence = SecondsFromNow(kSilence_s);
  for (bool standing = false; !standing && Now() < silence;) {
    const auto message = hear(SecondsFromNow(kQuestion_s));
    if (!message) {
      ask();
    } else if (const auto* status = std::get_if<Status>(&*message)) {
      silence = SecondsFromNow(kSilence_s);
      standing = !IsMoving(*status);
      if (status->state == State::kAlarm) kept = false;
    }
    if (Now() >= operation.deadline)
      throw Failure(operation, Fault::kTimeout, "does not come to rest", "cut its power");
  }
  if (Now() >= silence) kept = false;

  SendRealtime(kReset, operation.deadline);
  for (;;) {
    const bool restarting = kept;
    const auto message = hear(operation.deadline);
    if (!message)
      throw Failure(operation, Fault::kTimeout, "no welcome after a reset",
                    "check that it is a Grbl 1.1, grblHAL or FluidNC controller, its power, cable "
                    "and baud rate");
    if (std::holds_alternative<Welcome>(*message)) {
      kept = restarting;
      break;
    }
  }
  work_offset_.reset();  // the first report after a reset has it
  return AskStatus(operation).state != State::kAlarm && kept;
}

// Somebody at the machine has stopped it, or an alarm has, unheard.
void GrblStage::CheckUndisturbed(const Operation& operation, const Status& status) const {
  // Before homing a controller may well be locked: homing is what unlocks it.
  const bool locked = status.state == State::kAlarm && homed();
  const bool held =
      status.state == State::kHold || status.state == State::kDoor || status.state == State::kSleep;
  if (stop_requested() || (!locked && !held)) return;
  throw Failure(operation, locked ? Fault::kNotHomed : Fault::kStopped,
                "the controller says " + StateName(status.state),
                "clear door, feed hold and switches, then home", true);
}

void GrblStage::WaitUntilStandingAt(const Operation& operation,
                                    const std::array<double, 2>& target_mm) {
  constexpr double kRounding_mm = 0.001;  // reports have three decimals
  for (int there = 0, elsewhere = 0; there < 2;) {
    ThrowIfStopped(operation);
    const Status status = AskStatus(operation);
    CheckUndisturbed(operation, status);
    const auto at_mm = *MachineMm(status);
    bool near = status.state == State::kIdle;
    for (int k = 0; k < 2; ++k)
      near = near && std::abs(at_mm[k] - target_mm[k]) <=
                         controller_.StepMm(axes_[k].machine_axis, identity_) + kRounding_mm;
    there = near ? there + 1 : 0;
    if (near) continue;
    if (status.state == State::kIdle && ++elsewhere == kPatience)
      throw Failure(operation, Fault::kProtocol,
                    fmt::format("stands at ({:.3f}, {:.3f}) mm instead of ({:.3f}, {:.3f})",
                                at_mm[0], at_mm[1], target_mm[0], target_mm[1]),
                    "check the cable and the settings, then home");
    const SteadyTime question = SecondsFromNow(kQuestion_s);
    while (Listen(operation, question)) {
    }
  }
}

void GrblStage::DriveHome(const Operation& operation) {
  Command(operation, "$H");
  // An `ok` alone proves nothing: a failed cycle sends one behind its alarm.
  WaitUntilStandingAt(operation, {controller_.HomeMm(axes_[0].machine_axis, identity_),
                                  controller_.HomeMm(axes_[1].machine_axis, identity_)});
}

void GrblStage::DriveTo(const Operation& operation, Vec2 centre) {
  const std::array target_mm = {axes_[0].MachineMm(centre.x), axes_[1].MachineMm(centre.y)};
  Command(operation,
          fmt::format("G21G90G94G53G1{}{:.4f}{}{:.4f}F{:.3f}", "XYZ"[axes_[0].machine_axis],
                      target_mm[0], "XYZ"[axes_[1].machine_axis], target_mm[1], feed_mm_per_min_));
  Command(operation, "G4P0.01");
  WaitUntilStandingAt(operation, target_mm);
}

void GrblStage::AskPosition(const Operation& operation) {
  while (Listen(operation, Now())) {
  }
  CheckUndisturbed(operation, AskStatus(operation));
}

std::optional<std::array<double, 2>> GrblStage::MachineMm(const Status& status) const {
  if (status.work_position && !work_offset_) return {};
  std::array<double, 2> at;
  for (int k = 0; k < 2; ++k) {
    const int axis = axes_[k].machine_axis;
    at[k] = status.position[axis] + (status.work_position ? (*work_offset_)[axis] : 0);
  }
  return at;
}

void GrblStage::Remember(const Status& status) {
  if (status.work_offset) work_offset_ = status.work_offset;
  if (const auto at_mm = MachineMm(status))
    Heard({axes_[0].Metres((*at_mm)[0]), axes_[1].Metres((*at_mm)[1])}, IsMoving(status));
}

}  // namespace luxfield::hal::grbl
