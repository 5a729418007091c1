// A fake camera on USB (the still image class, PIMA 15740 annex D), under umockdev.
#pragma once

#include <atomic>
#include <deque>
#include <string>
#include <thread>

#include "tests/fakes/ptp_camera.h"
#include "tests/usb/fake_usb_device.h"

namespace luxfield::hal::gphoto2 {

class PtpUsbHost {
 public:
  PtpUsbHost(UMockdevTestbed* testbed, int product, fakes::PtpCamera& camera);
  ~PtpUsbHost();
  PtpUsbHost(const PtpUsbHost&) = delete;
  PtpUsbHost& operator=(const PtpUsbHost&) = delete;

  const std::string& port() const { return port_; }  // as libgphoto2 names it
  void Unplug() { usb_.Unplug(); }

 private:
  bool Out(const std::uint8_t* bytes, std::size_t size);
  std::optional<usb::Bytes> In(int endpoint, std::size_t room);
  void Execute();
  void QueueEvents();

  fakes::PtpCamera& camera_;
  std::string port_;
  // Under the lock of usb_: containers that programs read, and the operation that comes in.
  std::deque<std::string> replies_, events_;
  fakes::PtpOperation operation_;
  std::string data_;  // a data container, as far as it has come
  usb::FakeUsbDevice usb_;
  std::atomic<bool> ending_ = false;
  std::thread events_thread_;
};

}  // namespace luxfield::hal::gphoto2
