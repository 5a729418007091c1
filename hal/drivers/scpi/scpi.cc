#include "luxfield/hal/drivers/scpi/scpi.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "luxfield/core/printable.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::scpi {
namespace {

constexpr double kState_s = 2;   // of a reading that nobody gave a deadline
constexpr int kMostErrors = 20;  // in an instrument's queue
constexpr int kQueryErrors = -400, kMostQueryError = -499;
constexpr double kInfinity = 9.9e37, kNotANumber = 9.91e37;

std::string_view Trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

std::optional<double> ParseNumber(std::string_view text) {
  text = Trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with('+') || text.empty()) return {};
  // "inf" and "nan" are words to from_chars, not to SCPI.
  if (const char c = text[text.starts_with('-') ? std::min<std::size_t>(1, text.size() - 1) : 0];
      (c < '0' || c > '9') && c != '.')
    return {};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  if (std::abs(value - kNotANumber) < 1e33) return std::numeric_limits<double>::quiet_NaN();
  if (std::abs(std::abs(value) - kInfinity) < 1e33)
    return std::copysign(std::numeric_limits<double>::infinity(), value);
  return value;
}

std::optional<ErrorEntry> ParseError(std::string_view text) {
  text = Trimmed(text);
  const std::size_t comma = text.find(',');
  std::string_view number = Trimmed(text.substr(0, comma));
  if (number.starts_with('+')) number.remove_prefix(1);
  ErrorEntry entry;
  const auto [end, error] =
      std::from_chars(number.data(), number.data() + number.size(), entry.code);
  if (error != std::errc() || end != number.data() + number.size() || number.empty()) return {};
  if (comma != std::string_view::npos) {
    std::string_view words = Trimmed(text.substr(comma + 1));
    if (words.size() >= 2 && words.front() == '"' && words.back() == '"')
      words = words.substr(1, words.size() - 2);
    entry.text = core::Printable(words);
  }
  return entry;
}

Instrument::Instrument(std::unique_ptr<MessageChannel> channel, std::shared_ptr<core::Clock> clock,
                       double deadline_s, bool opc)
    : channel_(std::move(channel)), clock_(std::move(clock)), opc_(opc) {
  identity_ = core::Printable(Trimmed(Query("*IDN?", deadline_s)));
  channel_->Write("*CLS\n", OnSteadyClock(deadline_s, *clock_));
}

Instrument::Turn Instrument::Begin(const std::string& operation, SteadyTime deadline,
                                   Urgency urgency) {
  Turn urgent(urgent_, std::defer_lock), turn(turn_, std::defer_lock);
  const auto take = [&](Turn& lock) {
    if (!lock.try_lock_until(deadline))
      throw HardwareError(Fault::kTimeout, channel_->name(), operation,
                          "another call still waits for its answer",
                          "check that the instrument is not waiting for a trigger");
  };
  if (urgency == Urgency::kOrdinary) {
    take(turn);
    return turn;
  }
  take(urgent);
  channel_->GiveWay(true);
  try {
    take(turn);
  } catch (const HardwareError&) {
    channel_->GiveWay(false);
    throw;
  }
  channel_->GiveWay(false);
  return turn;
}

std::string Instrument::Ask(const std::string& query, SteadyTime deadline) {
  channel_->Write(query + "\n", deadline);
  return channel_->Read(deadline);
}

// *OPC? is answered, by 1, when no operation is pending any more (IEEE 488.2, 10.19).
void Instrument::AwaitSettled(const std::string& command, SteadyTime deadline) {
  std::string answer;
  try {
    answer = Ask("*OPC?", deadline);
  } catch (const HardwareError& error) {
    if (error.fault != Fault::kTimeout) throw;
    throw HardwareError(
        Fault::kTimeout, channel_->name(), command,
        "does not answer *OPC?: it has not settled by the deadline",
        "look at its display for a limit or a protection that has tripped; one that "
        "does not know *OPC? takes opc = false in its table of lab.toml");
  }
  if (ParseNumber(answer) != 1)
    throw HardwareError(Fault::kProtocol, channel_->name(), command,
                        fmt::format("answers *OPC? with '{}'", core::Printable(answer)),
                        "check that it is a SCPI instrument");
}

void Instrument::Command(const std::string& command, double deadline_s, Urgency urgency) {
  const SteadyTime deadline = OnSteadyClock(deadline_s, *clock_);
  const Turn turn = Begin(command, deadline, urgency);
  channel_->Write(command + "\n", deadline);
  if (opc_ && urgency == Urgency::kOrdinary) AwaitSettled(command, deadline);
  std::string errors;
  for (int k = 0; k < kMostErrors; ++k) {
    const std::string answer = Ask("SYST:ERR?", deadline);
    const auto entry = ParseError(answer);
    if (!entry)
      throw HardwareError(Fault::kProtocol, channel_->name(), command,
                          fmt::format("answers SYST:ERR? with '{}'", core::Printable(answer)),
                          "check that it is a SCPI instrument");
    if (entry->code == 0) break;
    // Of an answer that nobody waited for: no command has any.
    if (entry->code <= kQueryErrors && entry->code >= kMostQueryError) continue;
    errors += fmt::format("{}{} {}", errors.empty() ? "" : ", ", entry->code, entry->text);
  }
  if (!errors.empty())
    throw HardwareError(Fault::kRefused, channel_->name(), command, errors,
                        "check the values in lab.toml against the instrument's manual");
}

std::string Instrument::Query(const std::string& query, double deadline_s, Urgency urgency) {
  const SteadyTime deadline = OnSteadyClock(deadline_s, *clock_);
  const Turn turn = Begin(query, deadline, urgency);
  return Ask(query, deadline);
}

double Instrument::QueryNumber(const std::string& query, double deadline_s) {
  const std::string answer = Query(query, deadline_s);
  if (const auto value = ParseNumber(answer)) return *value;
  throw HardwareError(Fault::kProtocol, channel_->name(), query,
                      fmt::format("answers '{}', which is no number", core::Printable(answer)),
                      "check that it is a SCPI instrument that knows this query");
}

ScpiSupply::ScpiSupply(std::unique_ptr<MessageChannel> channel, const SupplyOptions& options,
                       std::shared_ptr<core::Clock> clock, double deadline_s)
    : instrument_(std::move(channel), clock, deadline_s, options.opc),
      options_(options),
      clock_(std::move(clock)) {}

ScpiSupply::~ScpiSupply() {
  if (!switched_on_) return;
  try {
    SetOutput(false, clock_->MonotonicSeconds() + kState_s);
  } catch (const HardwareError&) {
    // It is gone; docs/safety.md says why the emergency stop is hardware.
  }
}

void ScpiSupply::SetLevel(const std::string& header, double value, double deadline_s) {
  instrument_.Command(fmt::format("{} {:.6g}", header, value), deadline_s);
  const double set = instrument_.QueryNumber(header + "?", deadline_s);
  if (!(std::abs(set - value) <= options_.tolerance * std::abs(value) + 1e-3))
    throw HardwareError(Fault::kRefused, identity(), header,
                        fmt::format("asked for {}, reads back {}", value, set),
                        "choose a value within the supply's range");
}

bool ScpiSupply::Output(double deadline_s, Urgency urgency) {
  const std::string answer = instrument_.Query("OUTP?", deadline_s, urgency);
  const std::string_view state = Trimmed(answer);
  if (state == "1" || state == "ON") return true;
  if (state == "0" || state == "OFF") return false;
  throw HardwareError(Fault::kProtocol, identity(), "OUTP?",
                      fmt::format("answers '{}'", core::Printable(answer)), "check the instrument");
}

SupplyState ScpiSupply::SetOutput(bool on, double deadline_s) {
  if (on) {
    SetLevel("VOLT", options_.voltage_v, deadline_s);
    SetLevel("CURR", options_.current_a, deadline_s);
    switched_on_ = true;
  }
  const Urgency urgency = on ? Urgency::kOrdinary : Urgency::kUrgent;
  instrument_.Command(on ? "OUTP ON" : "OUTP OFF", deadline_s, urgency);
  if (Output(deadline_s, urgency) != on)
    throw HardwareError(Fault::kRefused, identity(), on ? "switch on" : "switch off",
                        "the output does not read back as set",
                        "check the supply's protection and interlock");
  if (!on) switched_on_ = false;
  return Measure(deadline_s);
}

SupplyState ScpiSupply::State() { return Measure(clock_->MonotonicSeconds() + kState_s); }

SupplyState ScpiSupply::Measure(double deadline_s) {
  return {instrument_.QueryNumber("MEAS:VOLT?", deadline_s),
          instrument_.QueryNumber("MEAS:CURR?", deadline_s), Output(deadline_s)};
}

ScpiMeter::ScpiMeter(std::unique_ptr<MessageChannel> channel, MeterOptions options,
                     std::shared_ptr<core::Clock> clock, double deadline_s)
    : instrument_(std::move(channel), clock, deadline_s),
      options_(std::move(options)),
      clock_(std::move(clock)) {}

Reading ScpiMeter::Read(double deadline_s) {
  const double begin_s = clock_->MonotonicSeconds();
  Reading reading;
  reading.value = instrument_.QueryNumber(options_.query, deadline_s);
  reading.t_s = 0.5 * (begin_s + clock_->MonotonicSeconds());
  reading.unit = options_.unit;
  reading.over_range = !std::isfinite(reading.value);
  return reading;
}

}  // namespace luxfield::hal::scpi
