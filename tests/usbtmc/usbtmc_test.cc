#include "luxfield/hal/drivers/usbtmc/usbtmc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/hal/error.h"
#include "tests/hal/error_of.h"
#include "tests/hal/fewer_rights.h"
#include "tests/usbtmc/fake_instrument.h"

namespace luxfield::hal::usbtmc {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Echo(const std::string& message) {
  if (message == "*IDN?\n") return "ACME,LightMeter,7,1.0\n";
  if (message == "LONG?\n") return std::string(5000, 'x') + "\n";
  return {};
}

class UsbTmcDeviceTest : public testing::Test {
 protected:
  UsbTmcOptions Options(Quirks quirks = {}) const {
    return {FakeInstrument::kVendor, FakeInstrument::kProduct, {}, quirks};
  }
  std::string Ask(UsbTmc& device, const std::string& query, double seconds = 5) {
    device.Write(query + "\n", SecondsFromNow(seconds));
    return device.Read(SecondsFromNow(seconds));
  }

  FakeInstrument instrument_{Echo};
};

TEST_F(UsbTmcDeviceTest, IsListedOpenedClearedAndAnswers) {
  const auto devices = ListUsbTmcDevices();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].vendor, FakeInstrument::kVendor);
  EXPECT_EQ(devices[0].serial, "7");
  UsbTmc device(Options());
  EXPECT_EQ(instrument_.clears(), 1);
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
  EXPECT_THAT(instrument_.messages(), ElementsAre("*IDN?\n", "*IDN?\n"));
}

TEST_F(UsbTmcDeviceTest, LongRepliesComeInSeveralTransfers) {
  UsbTmc device(Options());
  for (const std::size_t at_once : {511u, 500u, 1024u}) {
    instrument_.Set({.at_once = at_once});
    EXPECT_EQ(Ask(device, "LONG?"), std::string(5000, 'x'));
  }
}

TEST_F(UsbTmcDeviceTest, AMuteInstrumentTimesOutAndAnswersAfterwards) {
  UsbTmc device(Options());
  instrument_.Set({.mute = true});
  const auto begin = std::chrono::steady_clock::now();
  const HardwareError error = ErrorOf([&] { Ask(device, "*IDN?", 0.1); });
  EXPECT_EQ(error.fault, Fault::kTimeout);
  EXPECT_THAT(error.what(), HasSubstr("1209:0001"));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
  EXPECT_EQ(instrument_.aborts(), 1);
  instrument_.Set({});
  EXPECT_EQ(Ask(device, "LONG?"), std::string(5000, 'x')) << "not the reply that came too late";
}

TEST_F(UsbTmcDeviceTest, StaleTagsAreRefusedUnlessKnown) {
  UsbTmc device(Options());
  instrument_.Set({.stale_tag = true});
  EXPECT_EQ(ErrorOf([&] { Ask(device, "*IDN?"); }).fault, Fault::kProtocol);
  EXPECT_EQ(instrument_.aborts(), 1);
  UsbTmc known(Options({.any_tag = true}));
  EXPECT_EQ(Ask(known, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, WhatHangsOnAClearIsNotCleared) {
  instrument_.Set({.dies_of_clear = true});
  UsbTmc known(Options({.no_clear = true}));
  EXPECT_EQ(Ask(known, "*IDN?"), "ACME,LightMeter,7,1.0");
  EXPECT_EQ(instrument_.clears(), 0);
  UsbTmc cleared(Options());
  EXPECT_EQ(ErrorOf([&] { Ask(cleared, "*IDN?", 0.1); }).fault, Fault::kTimeout);
}

TEST_F(UsbTmcDeviceTest, RepliesWithOneHeaderAreReadToTheirEndWhereThatIsKnown) {
  UsbTmc known(Options({.one_header = true}));
  EXPECT_EQ(Ask(known, "LONG?"), std::string(5000, 'x')) << "of an instrument that does not";
  for (const std::size_t at_once : {52u, 500u, 512u, 5001u}) {
    SCOPED_TRACE(at_once);
    instrument_.Set({.at_once = at_once, .one_header = true});
    EXPECT_EQ(Ask(known, "LONG?"), std::string(5000, 'x'));
    EXPECT_EQ(Ask(known, "*IDN?"), "ACME,LightMeter,7,1.0");
  }
  UsbTmc other(Options());
  instrument_.Set({.at_once = 500, .one_header = true});
  EXPECT_EQ(ErrorOf([&] { Ask(other, "LONG?"); }).fault, Fault::kProtocol);
}

TEST_F(UsbTmcDeviceTest, AReplyWithOneHeaderThatStopsIsATimeout) {
  UsbTmc known(Options({.one_header = true}));
  instrument_.Set({.at_once = 500, .one_header = true});
  int transfers = 0;
  instrument_.SetDamage([&](usb::Bytes&) { return ++transfers < 3; });
  EXPECT_EQ(ErrorOf([&] { Ask(known, "LONG?", 0.1); }).fault, Fault::kTimeout);
  instrument_.SetDamage({});
  EXPECT_EQ(Ask(known, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, PiecesThatNeverEndEndWithTheDeadline) {
  UsbTmc device(Options());
  instrument_.Set({.at_once = 0});
  constexpr int kMany = 100'000;
  int pieces = 0;
  instrument_.SetDamage([&](usb::Bytes&) { return ++pieces < kMany; });
  EXPECT_EQ(ErrorOf([&] { Ask(device, "LONG?", 0.05); }).fault, Fault::kTimeout);
  EXPECT_GT(pieces, 1);
  EXPECT_LT(pieces, kMany);
  instrument_.Set({});
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, ACutReplyIsNoReply) {
  UsbTmc device(Options());
  instrument_.Set({.cut = true});
  EXPECT_EQ(ErrorOf([&] { Ask(device, "*IDN?"); }).fault, Fault::kProtocol);
  instrument_.Set({});
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, AStalledEndpointIsClearedForTheNextMessage) {
  UsbTmc device(Options());
  instrument_.Set({.stall_out = true});
  EXPECT_EQ(ErrorOf([&] { Ask(device, "*IDN?"); }).fault, Fault::kProtocol);
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, SoIsOneThatStallsAfterTheMessage) {
  UsbTmc device(Options());
  device.Write("*IDN?\n", SecondsFromNow(5));
  instrument_.Set({.stall_out = true});
  EXPECT_EQ(ErrorOf([&] { device.Read(SecondsFromNow(5)); }).fault, Fault::kProtocol);
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,LightMeter,7,1.0");
}

TEST_F(UsbTmcDeviceTest, APulledCableIsDisconnected) {
  UsbTmc device(Options());
  instrument_.Unplug();
  EXPECT_EQ(ErrorOf([&] { Ask(device, "*IDN?"); }).fault, Fault::kDisconnected);
}

TEST_F(UsbTmcDeviceTest, AnInstrumentThatIsNotThere) {
  UsbTmcOptions options = Options();
  options.product = 2;
  EXPECT_EQ(ErrorOf([&] { UsbTmc device(options); }).fault, Fault::kDisconnected);
  options = Options();
  options.serial = "8";
  EXPECT_EQ(ErrorOf([&] { UsbTmc device(options); }).fault, Fault::kDisconnected);
  options.serial = "7";
  EXPECT_NO_THROW(UsbTmc device(options));
}

TEST_F(UsbTmcDeviceTest, AnInstrumentOfOthersIsRefusedWithTheGroupToJoin) {
  const Forbidden node("/dev/bus/usb/001/002");
  const HardwareError error = ErrorOf([&] { UsbTmc device(Options()); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(),
              testing::AllOf(HasSubstr("1209:0001"), HasSubstr("group plugdev"),
                             HasSubstr("udev rule"), HasSubstr("docs/how-to/permissions.md")));
  const auto devices = ListUsbTmcDevices();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].problem, error.what());
}

TEST(UsbTmcQuirks, AreOffButForTheInstrumentsThatHaveThem) {
  const auto names = [](std::uint16_t vendor, std::uint16_t product) {
    return QuirkNames(FindQuirks(vendor, product));
  };
  EXPECT_EQ(names(0x1313, 0x8078), "");
  EXPECT_EQ(names(0x1ab1, 0x0e11), "no_clear");
  EXPECT_EQ(names(0x1ab1, 0x044d), "no_clear, any_tag");
  for (const std::uint16_t product : std::initializer_list<std::uint16_t>{0x04ce, 0x0588, 0x04b0})
    EXPECT_EQ(names(0x1ab1, product), "no_clear, one_header");
  EXPECT_EQ(UsbTmcOptions({.vendor = 0x1ab1, .product = 0x04ce}).quirks,
            FindQuirks(0x1ab1, 0x04ce));
}

}  // namespace
}  // namespace luxfield::hal::usbtmc
