// SCPI instruments: a supply and a meter over any MessageChannel (SCPI-99; IEEE 488.2).
//
// Every setting is followed by *OPC? until it has settled, SYST:ERR? until that says 0, and read
// back; every call keeps its deadline. Only what is urgent does not wait for it to settle. Calls
// may come from any thread; they wait for each other, but for urgent ones: whoever waits for an
// answer then gives up at once, with HardwareError(kStopped).
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/hal/drivers/scpi/message_channel.h"
#include "luxfield/hal/instruments.h"

namespace luxfield::hal::scpi {

// A number as instruments write it: "+1.23400E+02", blanks around it allowed. Absent for anything
// else. SCPI's infinities (9.9E37, -9.9E37) and not-a-number (9.91E37) become those of double.
std::optional<double> ParseNumber(std::string_view text);

// "-113,\"Undefined header\"" or "+0,\"No error\"".
struct ErrorEntry {
  int code = 0;
  std::string text;
};
std::optional<ErrorEntry> ParseError(std::string_view text);

enum class Urgency { kOrdinary, kUrgent };

class Instrument {
 public:
  // Asks *IDN?, clears old errors (*CLS). Without `opc` it is never asked whether it has settled.
  Instrument(std::unique_ptr<MessageChannel> channel, std::shared_ptr<core::Clock> clock,
             double deadline_s, bool opc = true);

  const std::string& identity() const { return identity_; }  // maker, model, serial, firmware

  // HardwareError: kRefused with what the instrument says of the command, kTimeout where it has not
  // settled by the deadline.
  void Command(const std::string& command, double deadline_s, Urgency urgency = Urgency::kOrdinary);
  std::string Query(const std::string& query, double deadline_s,
                    Urgency urgency = Urgency::kOrdinary);
  // kProtocol if the answer is no number.
  double QueryNumber(const std::string& query, double deadline_s);

 private:
  // Alone with the instrument while it is held; HardwareError(kTimeout) at the deadline.
  using Turn = std::unique_lock<std::timed_mutex>;
  Turn Begin(const std::string& operation, SteadyTime deadline, Urgency urgency);
  std::string Ask(const std::string& query, SteadyTime deadline);
  void AwaitSettled(const std::string& command, SteadyTime deadline);

  std::unique_ptr<MessageChannel> channel_;
  std::shared_ptr<core::Clock> clock_;
  bool opc_;
  std::timed_mutex turn_;
  std::timed_mutex urgent_;  // held from giving way until the turn has come
  std::string identity_;
};

struct SupplyOptions {
  double voltage_v = 0, current_a = 0;  // set before the output is switched on
  // A set value must read back within this share, a resolution of any laboratory supply.
  double tolerance = 0.005;
  bool opc = true;  // it knows *OPC?
};

// A laboratory supply (VOLT, CURR, OUTP, MEAS:VOLT?, MEAS:CURR?). It switches its output off when
// it is destroyed if it switched it on.
class ScpiSupply : public Supply {
 public:
  ScpiSupply(std::unique_ptr<MessageChannel> channel, const SupplyOptions& options,
             std::shared_ptr<core::Clock> clock, double deadline_s);
  ~ScpiSupply() override;

  std::string identity() const override { return instrument_.identity(); }
  // To switch off is urgent: it does not wait for the answer to another call.
  SupplyState SetOutput(bool on, double deadline_s) override;
  SupplyState State() override;  // measured

 private:
  void SetLevel(const std::string& header, double value, double deadline_s);
  bool Output(double deadline_s, Urgency urgency = Urgency::kOrdinary);
  SupplyState Measure(double deadline_s);

  Instrument instrument_;
  SupplyOptions options_;
  std::shared_ptr<core::Clock> clock_;
  std::atomic<bool> switched_on_ = false;
};

struct MeterOptions {
  std::string query = "READ?";  // for instance "MEAS:ILL?" or "MEAS:POW?"
  std::string unit;             // of the answer
};

class ScpiMeter : public Meter {
 public:
  ScpiMeter(std::unique_ptr<MessageChannel> channel, MeterOptions options,
            std::shared_ptr<core::Clock> clock, double deadline_s);

  std::string identity() const override { return instrument_.identity(); }
  // over_range where the instrument says so (9.9E37).
  Reading Read(double deadline_s) override;

 private:
  Instrument instrument_;
  MeterOptions options_;
  std::shared_ptr<core::Clock> clock_;
};

}  // namespace luxfield::hal::scpi
