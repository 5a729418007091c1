#include "luxfield/hal/drivers/scpi/scpi.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <future>
#include <random>

#include "luxfield/hal/drivers/usbtmc/usbtmc.h"
#include "luxfield/hal/error.h"
#include "tests/hal/error_of.h"
#include "tests/usbtmc/fake_instrument.h"
#include "tests/usbtmc/fake_supply.h"

namespace luxfield::hal::scpi {
namespace {

using testing::HasSubstr;
using usbtmc::FakeInstrument;

TEST(ScpiNumbers, AsInstrumentsWriteThem) {
  EXPECT_EQ(ParseNumber("+1.23400E+02"), 123.4);
  EXPECT_EQ(ParseNumber(" -0.5\r\n"), -0.5);
  EXPECT_EQ(ParseNumber("7"), 7);
  EXPECT_EQ(ParseNumber(".25"), 0.25);
  EXPECT_EQ(ParseNumber("9.9E37"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ParseNumber("-9.90000000E+37"), -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(*ParseNumber("9.91E37")));
  for (const char* text :
       {"", "-", "+", "inf", "nan", "-inf", "1,2", "1 2", "++1", "0x10", "1e999"})
    EXPECT_FALSE(ParseNumber(text)) << text;
}

TEST(ScpiErrors, AreCodeAndText) {
  EXPECT_EQ(ParseError("+0,\"No error\"")->code, 0);
  EXPECT_EQ(ParseError("-113,\"Undefined header\"\n")->text, "Undefined header");
  EXPECT_EQ(ParseError("0")->code, 0);
  for (const char* text : {"", "\"No error\"", "x,1", "1.5,\"\"", "99999999999,\"\""})
    EXPECT_FALSE(ParseError(text)) << text;
}

TEST(ScpiParsers, AnyBytesEndInAValueOrNone) {
  const unsigned seed = 99;
  SCOPED_TRACE(seed);
  std::mt19937 generator(seed);
  constexpr std::string_view kLikely = "0123456789+-.eE,\" \n\t";
  int numbers = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    std::string text(generator() % 12, ' ');
    for (char& c : text)
      c = generator() % 8 ? kLikely[generator() % kLikely.size()] : static_cast<char>(generator());
    numbers += ParseNumber(text).has_value();
    if (const auto entry = ParseError(text)) {
      ASSERT_LE(entry->text.size(), 60u);
    }
  }
  EXPECT_GT(numbers, 100);
}

class Scpi : public testing::Test {
 protected:
  std::unique_ptr<MessageChannel> Channel() {
    return std::make_unique<usbtmc::UsbTmc>(
        usbtmc::UsbTmcOptions{FakeInstrument::kVendor, FakeInstrument::kProduct, {}});
  }
  double Soon() { return clock_->MonotonicSeconds() + 5; }

  FakeSupply supply_;
  FakeInstrument instrument_{
      [this](const std::string& message) { return supply_.Answer(message); }};
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
};

TEST_F(Scpi, ASupplySetsReadsBackMeasuresAndSwitchesOffWhatItSwitchedOn) {
  {
    ScpiSupply supply(Channel(), {12.5, 2, 0.005}, clock_, Soon());
    EXPECT_EQ(supply.identity(), "ACME,PS30,1,2.0");
    EXPECT_FALSE(supply.State().output);
    const SupplyState on = supply.SetOutput(true, Soon());
    EXPECT_TRUE(on.output);
    EXPECT_DOUBLE_EQ(on.voltage_v, 12.5);
    EXPECT_DOUBLE_EQ(on.current_a, 1);
  }
  EXPECT_FALSE(supply_.on());
}

TEST_F(Scpi, ASupplyThatWasOnBeforeIsLeftOn) {
  supply_.Answer("OUTP ON\n");
  { ScpiSupply supply(Channel(), {12.5, 2, 0.005}, clock_, Soon()); }
  EXPECT_TRUE(supply_.on());
}

TEST_F(Scpi, WhatTheInstrumentRefusesIsToldAndNothingIsSwitchedOn) {
  ScpiSupply supply(Channel(), {48, 2, 0.005}, clock_, Soon());
  try {
    supply.SetOutput(true, Soon());
    FAIL();
  } catch (const HardwareError& error) {
    EXPECT_EQ(error.fault, Fault::kRefused);
    EXPECT_THAT(error.what(), HasSubstr("VOLT 48"));
    EXPECT_THAT(error.what(), HasSubstr("-222 Data out of range"));
  }
  EXPECT_FALSE(supply_.on());
}

// While one call waits for a measurement that does not come.
TEST(ScpiSupply, CallsWaitForEachOtherUntilTheirDeadlineAndToSwitchOffDoesNotWait) {
  const auto clock = std::make_shared<core::SystemClock>();
  const auto in = [&](double seconds) { return clock->MonotonicSeconds() + seconds; };
  std::promise<void> asked;
  std::atomic<bool> slow = false;
  FakeSupply model;
  FakeInstrument instrument([&](const std::string& message) {
    if (message == "OUTP OFF\n") slow = false;
    if (!slow || !message.starts_with("MEAS:")) return model.Answer(message);
    asked.set_value();
    return std::string();
  });
  ScpiSupply supply(std::make_unique<usbtmc::UsbTmc>(usbtmc::UsbTmcOptions{
                        FakeInstrument::kVendor, FakeInstrument::kProduct, {}}),
                    {12.5, 2, 0.005}, clock, in(5));
  supply.SetOutput(true, in(5));
  slow = true;
  auto reading = std::async(std::launch::async, [&] { return ErrorOf([&] { supply.State(); }); });
  asked.get_future().wait();
  const HardwareError late = ErrorOf([&] { supply.SetOutput(true, in(0.05)); });
  EXPECT_EQ(late.fault, Fault::kTimeout);
  EXPECT_THAT(late.what(), HasSubstr("another call"));
  EXPECT_FALSE(supply.SetOutput(false, in(5)).output);
  EXPECT_EQ(reading.get().fault, Fault::kStopped);
  EXPECT_FALSE(model.on());
  EXPECT_EQ(supply.State().voltage_v, 0);  // in step
}

// Answers as `model`, and *OPC? after `command` never.
std::function<std::string(const std::string&)> NeverSettled(FakeSupply& model,
                                                            const std::string& command) {
  return [&model, command, last = std::string()](const std::string& message) mutable {
    if (message == "*OPC?\n" && last == command + "\n") return std::string();
    last = message;
    return model.Answer(message);
  };
}

TEST(ScpiSupply, WhatNeverSettlesIsATimeoutThatNamesItAndGoesDarkAgain) {
  const auto clock = std::make_shared<core::SystemClock>();
  const auto in = [&](double seconds) { return clock->MonotonicSeconds() + seconds; };
  for (const std::string command : {"VOLT 12.5", "CURR 2", "OUTP ON"}) {
    SCOPED_TRACE(command);
    FakeSupply model;
    FakeInstrument instrument(NeverSettled(model, command));
    {
      ScpiSupply supply(std::make_unique<usbtmc::UsbTmc>(usbtmc::UsbTmcOptions{
                            FakeInstrument::kVendor, FakeInstrument::kProduct, {}}),
                        {12.5, 2, 0.005}, clock, in(5));
      const HardwareError error = ErrorOf([&] { supply.SetOutput(true, in(0.2)); });
      EXPECT_EQ(error.fault, Fault::kTimeout);
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(command), HasSubstr("*OPC?")));
      EXPECT_EQ(model.on(), command == "OUTP ON");
      EXPECT_FALSE(supply.State().voltage_v > 12) << "in step, and not settled";
    }
    EXPECT_FALSE(model.on());
  }
}

TEST(ScpiSupply, OneThatDoesNotKnowTheQuestionIsNotAskedWhetherItHasSettled) {
  const auto clock = std::make_shared<core::SystemClock>();
  FakeSupply model;
  FakeInstrument instrument([&](const std::string& message) {
    return message == "*OPC?\n" ? std::string() : model.Answer(message);
  });
  ScpiSupply supply(std::make_unique<usbtmc::UsbTmc>(usbtmc::UsbTmcOptions{
                        FakeInstrument::kVendor, FakeInstrument::kProduct, {}}),
                    {12.5, 2, 0.005, false}, clock, clock->MonotonicSeconds() + 5);
  EXPECT_TRUE(supply.SetOutput(true, clock->MonotonicSeconds() + 5).output);
  EXPECT_TRUE(model.on());
}

TEST(ScpiSupply, ToSwitchOffWaitsForNothingToSettle) {
  const auto clock = std::make_shared<core::SystemClock>();
  const auto in = [&](double seconds) { return clock->MonotonicSeconds() + seconds; };
  FakeSupply model;
  std::promise<void> asked;
  std::atomic<bool> told = false;
  FakeInstrument instrument(
      [&, answer = NeverSettled(model, "OUTP ON")](const std::string& message) mutable {
        std::string reply = answer(message);
        if (message == "*OPC?\n" && reply.empty() && !told.exchange(true)) asked.set_value();
        return reply;
      });
  ScpiSupply supply(std::make_unique<usbtmc::UsbTmc>(usbtmc::UsbTmcOptions{
                        FakeInstrument::kVendor, FakeInstrument::kProduct, {}}),
                    {12.5, 2, 0.005}, clock, in(5));
  auto lighting = std::async(std::launch::async,
                             [&] { return ErrorOf([&] { supply.SetOutput(true, in(60)); }); });
  asked.get_future().wait();
  EXPECT_FALSE(supply.SetOutput(false, in(5)).output);
  EXPECT_EQ(lighting.get().fault, Fault::kStopped);
  EXPECT_FALSE(model.on());
  const auto messages = instrument.messages();
  const auto off = std::find(messages.begin(), messages.end(), "OUTP OFF\n");
  EXPECT_EQ(std::count(off, messages.end(), "*OPC?\n"), 0);
}

TEST_F(Scpi, AMeterSaysWhenItIsOverRange) {
  ScpiMeter meter(Channel(), {"READ?", "lx"}, clock_, Soon());
  const Reading reading = meter.Read(Soon());
  EXPECT_TRUE(reading.over_range);
  EXPECT_EQ(reading.unit, "lx");
  ScpiMeter other(Channel(), {"MEAS:CURR?", "A"}, clock_, Soon());
  EXPECT_FALSE(other.Read(Soon()).over_range);
}

}  // namespace
}  // namespace luxfield::hal::scpi
