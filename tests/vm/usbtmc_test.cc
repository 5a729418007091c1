// The USBTMC driver over libusb, the kernel's USB stack and an instrument on its dummy_hcd.
#include "luxfield/hal/drivers/usbtmc/usbtmc.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <future>

#include "luxfield/hal/drivers/scpi/scpi.h"
#include "luxfield/hal/error.h"
#include "tests/hal/error_of.h"
#include "tests/vm/await.h"
#include "tests/vm/usb_instrument.h"

namespace luxfield::hal::usbtmc {
namespace {

using testing::HasSubstr;
using vm::Await;

constexpr const char* kKernelDevice = "/dev/usbtmc0";  // of the kernel's own driver

bool KernelDriverHasIt() { return std::filesystem::exists(kKernelDevice); }

class KernelUsb : public testing::Test {
 protected:
  UsbTmcOptions Options() const {
    return {vm::UsbInstrument::kVendor, vm::UsbInstrument::kProduct, "7"};
  }
  std::string Ask(UsbTmc& device, const std::string& query, double seconds = 30) {
    device.Write(query + "\n", SecondsFromNow(seconds));
    return device.Read(SecondsFromNow(seconds));
  }

  vm::UsbInstrument instrument_;
};

// Somebody else's host side, against which the fake instrument has to hold up.
TEST_F(KernelUsb, TheKernelsOwnDriverUnderstandsTheInstrument) {
  ASSERT_TRUE(Await(KernelDriverHasIt));
  const int file = open(kKernelDevice, O_RDWR | O_CLOEXEC);
  ASSERT_GE(file, 0);
  EXPECT_EQ(write(file, "*IDN?\n", 6), 6);
  std::array<char, 100> reply;
  const ssize_t size = read(file, reply.data(), reply.size());
  ASSERT_GT(size, 0);
  EXPECT_EQ(std::string(reply.data(), static_cast<std::size_t>(size)), "ACME,PS30,1,2.0\n");
  close(file);
}

TEST_F(KernelUsb, IsListedTakenFromTheKernelsDriverAndGivenBack) {
  ASSERT_TRUE(Await(KernelDriverHasIt));
  const auto devices = ListUsbTmcDevices();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].vendor, vm::UsbInstrument::kVendor);
  EXPECT_EQ(devices[0].serial, "7");
  EXPECT_EQ(devices[0].problem, "");
  {
    UsbTmc device(Options());
    EXPECT_FALSE(KernelDriverHasIt());
    EXPECT_EQ(Ask(device, "*IDN?"), "ACME,PS30,1,2.0");
    EXPECT_EQ(Ask(device, "OUTP?"), "0");
  }
  EXPECT_TRUE(Await(KernelDriverHasIt));
}

TEST_F(KernelUsb, WhoHasItClaimedKeepsIt) {
  UsbTmc device(Options());
  const HardwareError busy = ErrorOf([&] { UsbTmc second(Options()); });
  EXPECT_EQ(busy.fault, Fault::kRefused);
  EXPECT_THAT(busy.what(), HasSubstr("end the program that uses the instrument"));
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,PS30,1,2.0");
}

TEST_F(KernelUsb, LongRepliesComeInSeveralTransfers) {
  UsbTmc device(Options());
  for (const char* at_once : {"at once 511", "at once 500", "at once 1024", "at once 4084"}) {
    instrument_.Tell(at_once);
    EXPECT_EQ(Ask(device, "LONG?"), std::string(5000, 'x')) << at_once;
  }
}

TEST_F(KernelUsb, AMuteInstrumentTimesOutAndAnswersAfterwards) {
  UsbTmc device(Options());
  instrument_.Tell("mute");
  const HardwareError error = ErrorOf([&] { Ask(device, "*IDN?", 0.2); });
  EXPECT_EQ(error.fault, Fault::kTimeout);
  EXPECT_THAT(error.what(), HasSubstr("1209:0001 7: read the reply"));
  instrument_.Tell("answer");
  EXPECT_EQ(Ask(device, "VOLT?"), "+0.000000E+00") << "not the reply that came too late";
}

TEST_F(KernelUsb, AStalledEndpointIsClearedForTheNextMessage) {
  UsbTmc device(Options());
  instrument_.Tell("stall");
  device.Write("*IDN?\n", SecondsFromNow(30));
  EXPECT_EQ(ErrorOf([&] { device.Read(SecondsFromNow(30)); }).fault, Fault::kProtocol);
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,PS30,1,2.0");
}

TEST_F(KernelUsb, APulledCableEndsTheReadThatWaitsAndIsFoundAgainWhenItIsIn) {
  {
    UsbTmc device(Options());
    instrument_.Tell("mute");
    auto reading =
        std::async(std::launch::async, [&] { return ErrorOf([&] { Ask(device, "*IDN?", 300); }); });
    instrument_.AwaitWord("asked");
    instrument_.Unplug();
    // Not at its deadline, which would be kTimeout.
    EXPECT_EQ(reading.get().fault, Fault::kDisconnected);
    EXPECT_EQ(ErrorOf([&] { Ask(device, "*IDN?"); }).fault, Fault::kDisconnected);
    EXPECT_EQ(ErrorOf([&] { UsbTmc second(Options()); }).fault, Fault::kDisconnected);
    EXPECT_TRUE(ListUsbTmcDevices().empty());
  }
  instrument_.Tell("answer");
  instrument_.Plug();
  UsbTmc device(Options());
  EXPECT_EQ(Ask(device, "*IDN?"), "ACME,PS30,1,2.0");
}

TEST_F(KernelUsb, ASupplySetsMeasuresAndLosesItsCable) {
  const auto clock = std::make_shared<core::SystemClock>();
  const auto soon = [&] { return clock->MonotonicSeconds() + 30; };
  scpi::ScpiSupply supply(std::make_unique<UsbTmc>(Options()), {12.5, 2, 0.005}, clock, soon());
  const SupplyState on = supply.SetOutput(true, soon());
  EXPECT_TRUE(on.output);
  EXPECT_DOUBLE_EQ(on.voltage_v, 12.5);
  instrument_.Unplug();
  EXPECT_EQ(ErrorOf([&] { supply.State(); }).fault, Fault::kDisconnected);
  EXPECT_EQ(ErrorOf([&] { supply.SetOutput(false, soon()); }).fault, Fault::kDisconnected);
}

}  // namespace
}  // namespace luxfield::hal::usbtmc
