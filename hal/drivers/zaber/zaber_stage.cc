#include "luxfield/hal/drivers/zaber/zaber_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace luxfield::hal::zaber {
namespace {

constexpr double kConnect_s = 5;
constexpr double kQuestion_s = 0.05;   // between questions while it moves
constexpr double kSpeedUnit = 1.6384;  // maxspeed counts 1/1.6384 microsteps per second

SteadyTime Now() { return std::chrono::steady_clock::now(); }

}  // namespace

long Axis::Microsteps(double metres) const {
  return std::lround((origin_m + sign * metres) / microstep_m);
}
double Axis::Metres(double microsteps) const {
  return sign * (microsteps * microstep_m - origin_m);
}

ZaberStage::ZaberStage(std::unique_ptr<ByteStream> stream, const StageSetup& setup,
                       std::shared_ptr<core::Clock> clock)
    : ControllerStage(setup.limits, std::move(clock)),
      stream_(std::move(stream)),
      reader_(*stream_),
      axes_(setup.axes),
      identity_("Zaber stage on " + stream_->name()) {
  std::string ids;
  Connect(kConnect_s, [&](const Operation& connect) {
    for (int k = 0; k < 2; ++k) {
      CheckAxis(connect, axes_[k], setup, k);
      ids +=
          fmt::format("{}{}", k == 0 ? "" : " and ", Ask(connect, axes_[k], "get deviceid").data);
    }
  });
  identity_ = fmt::format("Zaber stage (devices {}) on {}", ids, stream_->name());
  SetResolution(std::max(axes_[0].microstep_m, axes_[1].microstep_m));
}

void ZaberStage::CheckAxis(const Operation& operation, const Axis& axis, const StageSetup& setup,
                           int k) {
  const auto [low, high] = k == 0 ? std::pair{setup.limits.min.x, setup.limits.max.x}
                                  : std::pair{setup.limits.min.y, setup.limits.max.y};
  const auto [from, to] = std::minmax({axis.Microsteps(low), axis.Microsteps(high)});
  const double least = AskNumber(operation, axis, "limit.min"),
               most = AskNumber(operation, axis, "limit.max");
  if (static_cast<double>(from) < least || static_cast<double>(to) > most)
    throw Failure(operation, Fault::kRefused,
                  fmt::format("the lab's limits are {} to {} microsteps of device {} axis {}, "
                              "its own {} to {}",
                              from, to, axis.device, axis.number, least, most),
                  "correct origin_m, microstep_m, min_m and max_m");
  const long speed = std::lround(setup.limits.speed_m_per_s / axis.microstep_m * kSpeedUnit);
  Ask(operation, axis, fmt::format("set maxspeed {}", speed));
  if (AskNumber(operation, axis, "maxspeed") != static_cast<double>(speed))
    throw Failure(operation, Fault::kRefused, "does not take the lab's speed",
                  "lower speed_m_per_s");
}

// Sends a command and waits for its reply.
Reply ZaberStage::Ask(const Operation& operation, const Axis& axis, std::string_view text) {
  id_ = (id_ + 1) % 100;
  stream_->Write(Command(axis.device, axis.number, id_, text), operation.deadline);
  for (;;) {
    const auto line = reader_.Next(operation.deadline);
    if (!line)
      throw Failure(operation, Fault::kTimeout,
                    fmt::format("no answer of device {} to \"{}\"", axis.device, text),
                    "check power, cable, baud rate and address, then home");
    const Message message = ParseMessage(*line);
    const auto* reply = std::get_if<Reply>(&message);
    if (!reply || reply->id != id_ || reply->device != axis.device) continue;
    if (!reply->accepted)
      throw Failure(operation, Fault::kRefused,
                    fmt::format("device {} rejects \"{}\": {} {}", axis.device, text, reply->data,
                                RejectionMeaning(reply->data)),
                    "correct the lab's limits and speed, or the device");
    return *reply;
  }
}

double ZaberStage::AskNumber(const Operation& operation, const Axis& axis,
                             std::string_view setting) {
  const std::string data = Ask(operation, axis, fmt::format("get {}", setting)).data;
  double value = 0;
  const auto [end, error] = std::from_chars(data.data(), data.data() + data.size(), value);
  if (error != std::errc() || end != data.data() + data.size() || !std::isfinite(value))
    throw Failure(operation, Fault::kProtocol, fmt::format("{} is \"{}\"", setting, data),
                  "check the cable, then home");
  return value;
}

// WR and WH say that homing is due; NI stays behind a stop until the next move; NU is a note about
// settings. Anything else is trouble.
void ZaberStage::CheckWarning(const Operation& operation, const Reply& reply) const {
  const std::string& flag = reply.warning;
  const bool unhomed = flag == "WR" || flag == "WH";
  if (flag == "--" || flag == "NU" || flag == "NI" || (unhomed && homing())) return;
  throw Failure(operation, unhomed ? Fault::kNotHomed : Fault::kStopped,
                fmt::format("device {} warns {}, {}", reply.device, flag, WarningMeaning(flag)),
                "clear its cause, then home", true);
}

// Asks both axes; true if one moves.
bool ZaberStage::Look(const Operation& operation, bool forgiving) {
  bool busy = false;
  Vec2 at;
  for (int k = 0; k < 2; ++k) {
    const Reply status = Ask(operation, axes_[k], "");
    if (!forgiving) CheckWarning(operation, status);
    busy = busy || status.busy;
    (k == 0 ? at.x : at.y) = axes_[k].Metres(AskNumber(operation, axes_[k], "pos"));
  }
  Heard(at, busy);
  return busy;
}

bool ZaberStage::Halt(const Operation& operation) {
  for (const Axis& axis : axes_) Ask(operation, axis, "stop");
  while (Look(operation, true)) Pause(operation);
  bool referenced = true;
  for (const Axis& axis : axes_) {
    const std::string warning = Ask(operation, axis, "warnings clear").warning;
    referenced = referenced && (warning == "--" || warning == "NU" || warning == "NI");
  }
  return referenced;
}

// Until it is time to ask again. Alerts and late replies may come meanwhile; nobody waits for them.
void ZaberStage::Pause(const Operation& operation) {
  if (Now() >= operation.deadline)
    throw Failure(operation, Fault::kTimeout, "still moves", "allow more time, then home");
  const SteadyTime question = std::min(operation.deadline, SecondsFromNow(kQuestion_s));
  while (reader_.Next(question)) {
  }
}

void ZaberStage::DriveHome(const Operation& operation) {
  for (const Axis& axis : axes_) Ask(operation, axis, "home");
  for (bool busy = true; busy;) {
    Pause(operation);
    busy = Look(operation, false);
    ThrowIfStopped(operation);  // behind the look: a stop is why it may be idle
  }
  for (const Axis& axis : axes_)
    if (const Reply status = Ask(operation, axis, ""); status.warning != "--")
      throw Failure(operation, Fault::kNotHomed,
                    fmt::format("device {} warns {} after homing, {}", axis.device, status.warning,
                                WarningMeaning(status.warning)),
                    "check its reference sensor");
}

void ZaberStage::DriveTo(const Operation& operation, Vec2 centre) {
  const std::array target = {axes_[0].Microsteps(centre.x), axes_[1].Microsteps(centre.y)};
  Look(operation, false);  // nothing moves that has lost its reference
  for (int k = 0; k < 2; ++k) Ask(operation, axes_[k], fmt::format("move abs {}", target[k]));
  for (bool busy = true; busy;) {
    Pause(operation);
    busy = Look(operation, false);
    ThrowIfStopped(operation);  // behind the look: a stop is why it may be idle
  }
  for (int k = 0; k < 2; ++k)
    if (const double at = AskNumber(operation, axes_[k], "pos");
        std::abs(at - static_cast<double>(target[k])) > 0.5)
      throw Failure(operation, Fault::kProtocol,
                    fmt::format("device {} stands at {} microsteps instead of {}", axes_[k].device,
                                at, target[k]),
                    "check the cable, then home");
}

void ZaberStage::AskPosition(const Operation& operation) { Look(operation, false); }

void ZaberStage::SendStop(bool, SteadyTime deadline) { stream_->Write("/stop\n", deadline); }

}  // namespace luxfield::hal::zaber
