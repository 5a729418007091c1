// A USB device that exists under umockdev only: the kernel's usbfs in front of endpoints of ours,
// for the real libusb in this process and in its children. Run the test program under
// umockdev-wrapper.
#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace luxfield::usb {

using Bytes = std::vector<std::uint8_t>;

class FakeUsbDevice {
 public:
  static constexpr std::uint16_t kVendor = 0x1209;

  // What the device does, called with the lock held.
  struct Endpoints {
    // The answer to a control request's eight bytes; nothing: it stalls.
    std::function<std::optional<Bytes>(const std::uint8_t* request)> control;
    // Takes what comes over an endpoint; false: it stalls.
    std::function<bool(int endpoint, const std::uint8_t* bytes, std::size_t size)> out;
    // The next transfer over an endpoint, of at most `room` bytes; nothing: none yet.
    std::function<std::optional<Bytes>(int endpoint, std::size_t room)> in;
    std::function<void()> clear_halt = [] {};
  };
  // Device 1209:`product`, 1 to 99, one configuration with one interface, whose descriptor and
  // those of its endpoints are given; string descriptors 1 to 3 are answered by `control`.
  FakeUsbDevice(UMockdevTestbed* testbed, int product, const Bytes& interface, Endpoints endpoints);
  ~FakeUsbDevice();
  FakeUsbDevice(const FakeUsbDevice&) = delete;
  FakeUsbDevice& operator=(const FakeUsbDevice&) = delete;

  // Of all that the endpoints touch.
  std::unique_lock<std::mutex> Lock() { return std::unique_lock(mutex_); }
  // Asks the endpoints again for programs that wait. Call with the lock held.
  void Serve();
  void Unplug();
  void Plug();  // in again

 private:
  // A transfer that a program submitted: umockdev's copies of its URB and of its buffer.
  struct Transfer {
    UMockdevIoctlData *urb = nullptr, *buffer = nullptr;

    usbdevfs_urb* fields() const { return reinterpret_cast<usbdevfs_urb*>(urb->data); }
    std::uint8_t* bytes() const { return buffer ? buffer->data : nullptr; }
    std::size_t size() const { return static_cast<std::size_t>(fields()->buffer_length); }
  };

  static gboolean OnIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  int Answer(unsigned long request, UMockdevIoctlData* argument);
  int Submit(UMockdevIoctlData* argument);
  int Reap(UMockdevIoctlData* argument);
  int Discard(UMockdevIoctlData* argument);
  void Finish(const Transfer& transfer, int status, std::size_t size);
  void Forget();

  std::string path_, sys_path_;
  Endpoints endpoints_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;

  std::mutex mutex_;  // of what follows, and of the endpoints
  bool gone_ = false;
  std::deque<Transfer> done_, waiting_;
};

}  // namespace luxfield::usb
