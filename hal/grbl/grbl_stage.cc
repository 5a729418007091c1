#include "hal/grbl/grbl_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hal/grbl/codes.h"

namespace luxfield::hal::grbl {
namespace {

constexpr char kStatusQuery = '?', kFeedHold = '!', kReset = 0x18;

constexpr double kConnect_s = 5;     // a board that restarts on opening takes two
constexpr double kAnswer_s = 1;      // for a status report; the documents say 5 to 20 ms
constexpr double kStop_s = 5;        // to slow down and restart
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

class GrblStage::Turn {
 public:
  explicit Turn(GrblStage& stage) : stage_(stage), lock_(stage.turn_) {}
  Turn(GrblStage& stage, std::try_to_lock_t)
      : stage_(stage), lock_(stage.turn_, std::try_to_lock) {}
  ~Turn() {
    if (!lock_) return;
    lock_.unlock();
    try {
      stage_.FinishStop();
    } catch (const HardwareError&) {  // the stage is marked suspect; the next operation says so
    }
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  bool taken() const { return lock_.owns_lock(); }

 private:
  GrblStage& stage_;
  std::unique_lock<std::mutex> lock_;
};

GrblStage::GrblStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
                     std::shared_ptr<core::Clock> clock)
    : stream_(std::move(stream)),
      reader_(*stream_),
      setup_(setup),
      clock_(std::move(clock)),
      identity_("Grbl stage on " + stream_->name()) {
  const Operation connect{"connect", SecondsFromNow(kConnect_s)};
  Guarded(connect, [&] {
    Halt(connect);
    for (const Message& message : Command(connect, "$I"))
      if (const auto* info = std::get_if<Feedback>(&message)) {
        std::string_view text = info->text;
        if (text.starts_with("VER:")) controller_.version = text.substr(4, text.find(':', 4) - 4);
        if (text.starts_with("OPT:"))
          controller_.forced_origin = text.substr(0, text.find(',')).find('Z') != text.npos;
      }
    for (const Message& message : Command(connect, "$$"))
      if (const auto* setting = std::get_if<Setting>(&message))
        controller_.settings[setting->number] = setting->value;
    CheckController(controller_, setup_, identity_);
  });
  identity_ = fmt::format("Grbl {} stage on {}", controller_.version, stream_->name());
  for (const Axis& axis : setup_.axes)
    setup_.limits.resolution_m = std::max(setup_.limits.resolution_m,
                                          1e-3 * controller_.StepMm(axis.machine_axis, identity_));
}

HardwareError GrblStage::Failure(const Operation& operation, Fault fault,
                                 const std::string& problem, const std::string& remedy) const {
  return {fault, identity_, operation.name, problem, remedy};
}

// Whatever goes wrong costs the position, but for a stop that says it has kept it. A machine that
// may still be moving is told to hold.
template <typename Work>
void GrblStage::Guarded(const Operation& operation, Work&& work) {
  try {
    work();
    return;
  } catch (HardwareError& error) {
    if (error.fault == Fault::kStopped && !error.position_lost) throw;
    error.position_lost = true;
    SetHomed(false);
    suspect_ = true;
    try {
      SendRealtime(homing_ ? kReset : kFeedHold, operation.deadline);
    } catch (const HardwareError&) {  // it cannot be told more than it could be asked
    }
    homing_ = false;
    throw;
  }
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
    const Meaning meaning = AlarmMeaning(alarm->code);
    HardwareError error = Failure(operation, stop_requested_ ? Fault::kStopped : meaning.fault,
                                  fmt::format("ALARM:{}, {}", alarm->code, meaning.problem),
                                  std::string(meaning.remedy));
    error.position_lost = true;
    throw error;
  }
  if (std::holds_alternative<Welcome>(message))
    throw Failure(operation, Fault::kNotHomed, "the controller has restarted",
                  "check its power and reset button, then home");
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
// report comes (critical alarm, homing, silence) the reset comes at once. True if the position was
// known before and has been kept.
bool GrblStage::Halt(const Operation& operation) {
  bool kept = !suspect_ && homed();
  const auto hear = [&](SteadyTime until) -> std::optional<Message> {
    const auto line = reader_.Next(std::min(until, operation.deadline));
    if (!line) return {};
    Message message = ParseMessage(*line);
    if (std::holds_alternative<Alarm>(message) || std::holds_alternative<Welcome>(message))
      kept = false;
    return message;
  };
  const auto ask = [&] {  // again, in case a byte was lost
    SendRealtime(kFeedHold, operation.deadline);
    SendRealtime(kStatusQuery, operation.deadline);
  };
  ask();
  SteadyTime silence = SecondsFromNow(kAnswer_s);
  for (bool standing = false; !standing && Now() < silence;) {
    const auto message = hear(SecondsFromNow(kQuestion_s));
    if (!message) {
      ask();
    } else if (const auto* status = std::get_if<Status>(&*message)) {
      silence = SecondsFromNow(kAnswer_s);
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
                    "check that it is a Grbl 1.1 controller, its power, cable and baud rate");
    if (std::holds_alternative<Welcome>(*message)) {
      kept = restarting;
      break;
    }
  }
  suspect_ = false;
  work_offset_.reset();  // the first report after a reset has it
  if (AskStatus(operation).state == State::kAlarm) kept = false;
  SetHomed(kept);
  return kept;
}

void GrblStage::ThrowIfStopped(const Operation& operation) {
  if (!stop_requested_.exchange(false)) return;
  const bool kept = Halt(operation);
  HardwareError error = Failure(operation, Fault::kStopped, "stopped on request",
                                kept ? "move it again when it is safe" : "home the stage");
  error.position_lost = !kept;
  throw error;
}

// Somebody at the machine has stopped it, or an alarm has, unheard.
void GrblStage::CheckUndisturbed(const Operation& operation, const Status& status) const {
  const bool locked = status.state == State::kAlarm && !homing_;
  const bool held =
      status.state == State::kHold || status.state == State::kDoor || status.state == State::kSleep;
  if (stop_requested_ || (!locked && !held)) return;
  HardwareError error = Failure(operation, locked ? Fault::kNotHomed : Fault::kStopped,
                                "the controller says " + StateName(status.state),
                                "clear door, feed hold and switches, then home");
  error.position_lost = true;
  throw error;
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
                         controller_.StepMm(setup_.axes[k].machine_axis, identity_) + kRounding_mm;
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

void GrblStage::Home(double deadline_s) {
  const Turn turn(*this);
  const Operation home{"home", OnSteadyClock(deadline_s, *clock_)};
  Guarded(home, [&] {
    SetHomed(false);
    if (suspect_) Halt(home);
    homing_ = true;
    Command(home, "$H");
    homing_ = false;
    // An `ok` alone proves nothing: a failed cycle sends one behind its alarm.
    std::array<double, 2> switches_mm;
    for (int k = 0; k < 2; ++k)
      switches_mm[k] = controller_.HomeMm(setup_.axes[k].machine_axis, identity_);
    WaitUntilStandingAt(home, switches_mm);
    SetHomed(true);
    const std::lock_guard lock(known_mutex_);
    known_.setpoint = known_.readback;
  });
}

void GrblStage::MoveTo(Vec2 centre, double deadline_s) {
  const Turn turn(*this);
  const Operation move{"move", OnSteadyClock(deadline_s, *clock_)};
  const StageLimits& limits = setup_.limits;
  if (!homed()) {
    HardwareError error =
        Failure(move, Fault::kNotHomed, "it does not know where it is", "home it first");
    error.position_lost = true;
    throw error;
  }
  if (!limits.Contain(centre))
    throw Failure(move, Fault::kOutOfRange,
                  fmt::format("({}, {}) m is outside [{}, {}] x [{}, {}]", centre.x, centre.y,
                              limits.min.x, limits.max.x, limits.min.y, limits.max.y),
                  "choose a smaller grid or another stage");
  Guarded(move, [&] {
    {
      const std::lock_guard lock(known_mutex_);
      known_.setpoint = centre;
    }
    const std::array target_mm = {setup_.axes[0].MachineMm(centre.x),
                                  setup_.axes[1].MachineMm(centre.y)};
    Command(move,
            fmt::format("G21G90G94G53G1{}{:.4f}{}{:.4f}F{:.3f}", "XYZ"[setup_.axes[0].machine_axis],
                        target_mm[0], "XYZ"[setup_.axes[1].machine_axis], target_mm[1],
                        limits.speed_m_per_s * 60000));
    Command(move, "G4P0.01");
    WaitUntilStandingAt(move, target_mm);
    if (clock_->MonotonicSeconds() + limits.settle_s > deadline_s)
      throw Failure(move, Fault::kTimeout, "arrived without the time left to settle",
                    "allow more time");
    clock_->SleepSeconds(limits.settle_s);
  });
}

StagePosition GrblStage::Where() {
  if (const Turn turn(*this, std::try_to_lock); turn.taken() && !suspect_) {
    const Operation read{"read position", SecondsFromNow(kAnswer_s)};
    try {
      Guarded(read, [&] {
        while (Listen(read, Now())) {
        }
        CheckUndisturbed(read, AskStatus(read));
      });
    } catch (const HardwareError& error) {  // a lost position is an answer, silence is none
      if (error.fault == Fault::kTimeout || error.fault == Fault::kDisconnected) throw;
    }
  }
  const std::lock_guard lock(known_mutex_);
  return known_;
}

void GrblStage::Stop() {
  stop_requested_ = true;
  SendRealtime(homing_ ? kReset : kFeedHold, SecondsFromNow(kAnswer_s));
  FinishStop();
}

void GrblStage::FinishStop() {
  while (stop_requested_) {
    const std::unique_lock turn(turn_, std::try_to_lock);
    if (!turn) return;  // the operation under way sees to it, at its end if not before
    if (!stop_requested_.exchange(false)) return;
    const Operation stop{"stop", SecondsFromNow(kStop_s)};
    Guarded(stop, [&] { Halt(stop); });
  }
}

std::optional<std::array<double, 2>> GrblStage::MachineMm(const Status& status) const {
  if (status.work_position && !work_offset_) return {};
  std::array<double, 2> at;
  for (int k = 0; k < 2; ++k) {
    const int axis = setup_.axes[k].machine_axis;
    at[k] = status.position[axis] + (status.work_position ? (*work_offset_)[axis] : 0);
  }
  return at;
}

void GrblStage::Remember(const Status& status) {
  if (status.work_offset) work_offset_ = status.work_offset;
  const auto at_mm = MachineMm(status);
  const std::lock_guard lock(known_mutex_);
  known_.moving = IsMoving(status);
  if (at_mm)
    known_.readback = {setup_.axes[0].Metres((*at_mm)[0]), setup_.axes[1].Metres((*at_mm)[1])};
}

bool GrblStage::homed() const {
  const std::lock_guard lock(known_mutex_);
  return known_.homed;
}

void GrblStage::SetHomed(bool homed) {
  const std::lock_guard lock(known_mutex_);
  known_.homed = homed;
}

}  // namespace luxfield::hal::grbl
