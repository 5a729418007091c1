// USBTMC instruments over libusb (USB Test and Measurement Class 1.0; USB488 subclass).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/hal/drivers/scpi/message_channel.h"

namespace luxfield::hal::usbtmc {

// What an instrument does not do as the standard says.
struct Quirks {
  bool no_clear = false;  // INITIATE_CLEAR hangs it: it is not cleared when it is opened
  bool any_tag = false;   // replies may carry a stale tag
  // Only the first transfer of a reply has a header, for the whole of it and with EOM set; what is
  // missing follows by itself, and to ask for it would start the reply again.
  bool one_header = false;

  bool operator==(const Quirks&) const = default;
};
// Those known of the instruments with these numbers; all off for any other.
Quirks FindQuirks(std::uint16_t vendor, std::uint16_t product);
// "no_clear, one_header": the names of lab.toml; empty: none.
std::string QuirkNames(const Quirks& quirks);

struct UsbTmcOptions {
  std::uint16_t vendor = 0, product = 0;
  std::string serial = {};  // empty: the only one with these numbers
  Quirks quirks = FindQuirks(vendor, product);
};

struct UsbTmcDevice {
  std::uint16_t vendor = 0, product = 0;
  std::string serial;   // empty where it cannot be opened
  std::string problem;  // why not
};
std::vector<UsbTmcDevice> ListUsbTmcDevices();

// One message out, one message in. A read that finds no answer by its deadline aborts the transfer
// as the class asks (INITIATE_ABORT_BULK_IN, drain, CHECK_ABORT_BULK_IN_STATUS), without which many
// instruments stay dead. Calls end by their deadline but for that sequence, at most 0.5 s.
class UsbTmc : public MessageChannel {
 public:
  // Detaches a kernel driver while it is open. HardwareError: kDisconnected, kRefused (permission,
  // another program, several of them).
  explicit UsbTmc(const UsbTmcOptions& options);
  ~UsbTmc() override;

  const std::string& name() const override { return name_; }
  void Write(std::string_view message, SteadyTime deadline) override;
  std::string Read(SteadyTime deadline) override;
  void GiveWay(bool give_way) override;

 private:
  struct Usb;

  void Clear();
  void AbortOut();
  void BeginAbortIn();
  void EndAbortIn();
  void DrainIn() const;
  void Request(std::uint32_t max_size, SteadyTime deadline);
  std::vector<std::uint8_t> Receive(std::size_t max_size, SteadyTime deadline);
  // As libusb_bulk_transfer from the bulk-IN endpoint, and LIBUSB_ERROR_INTERRUPTED where it gives
  // way.
  int BulkIn(std::vector<std::uint8_t>& bytes, int* moved, SteadyTime deadline) const;

  std::string name_;
  Quirks quirks_;
  std::unique_ptr<Usb> usb_;
  std::uint8_t tag_ = 0;
  enum class Abort { kNone, kBegun, kRefused };
  Abort abort_in_ = Abort::kNone;  // to be ended before the next reply is asked for
  std::atomic<bool> give_way_ = false;
};

}  // namespace luxfield::hal::usbtmc
