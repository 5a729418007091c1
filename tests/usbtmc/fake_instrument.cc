#include "tests/usbtmc/fake_instrument.h"

#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace luxfield::hal::usbtmc {
namespace {

// Device 1209:0001 with a serial number, one configuration, one USBTMC/USB488 interface with a bulk
// endpoint each way of 512 bytes.
constexpr std::uint8_t kDescriptors[] = {18,   1,    0x00, 0x02, 0,    0,    0, 64,   0x09,
                                         0x12, 0x01, 0x00, 0x00, 0x01, 0,    0, 3,    1,   //
                                         9,    2,    32,   0,    1,    1,    0, 0x80, 50,  //
                                         9,    4,    0,    0,    2,    0xfe, 3, 1,    0,   //
                                         7,    5,    0x81, 2,    0x00, 0x02, 0,            //
                                         7,    5,    0x02, 2,    0x00, 0x02, 0};
constexpr const char* kPath = "/dev/bus/usb/001/002";
constexpr const char* kSysPath = "/sys/devices/pci0000:00/usb1/1-1";

std::string Record() {
  std::string hex;
  for (const std::uint8_t byte : kDescriptors) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02X", byte);
    hex += digits;
  }
  return "P: /devices/pci0000:00/usb1/1-1\nN: bus/usb/001/002\nE: DEVNAME=/dev/bus/usb/001/002\n"
         "E: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=001\nE: DEVNUM=002\nE: MAJOR=189\n"
         "E: MINOR=1\nA: busnum=1\\n\nA: devnum=2\\n\nA: speed=480\\n\nA: "
         "bConfigurationValue=1\\n\n"
         "A: idVendor=1209\\n\nA: idProduct=0001\\n\nA: dev=189:1\\n\nH: descriptors=" +
         hex + "\n\n";
}

void Check(GError* error) {
  if (!error) return;
  const std::string what = error->message;
  g_error_free(error);
  throw std::runtime_error("umockdev: " + what);
}

}  // namespace

FakeInstrument::FakeInstrument(std::function<std::string(const std::string&)> answer)
    : answer_(std::move(answer)),
      testbed_(umockdev_testbed_new()),
      handler_(umockdev_ioctl_base_new()) {
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_, Record().c_str(), &error);
  Check(error);
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(OnIoctl), this);
  umockdev_testbed_attach_ioctl(testbed_, kPath, handler_, &error);
  Check(error);
}

FakeInstrument::~FakeInstrument() {
  g_object_unref(handler_);
  g_object_unref(testbed_);
}

void FakeInstrument::Set(const Faults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

void FakeInstrument::Unplug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = true;
  }
  umockdev_testbed_uevent(testbed_, kSysPath, "remove");
}

std::vector<std::string> FakeInstrument::messages() {
  const std::lock_guard lock(mutex_);
  return messages_;
}
int FakeInstrument::clears() {
  const std::lock_guard lock(mutex_);
  return clears_;
}
int FakeInstrument::aborts() {
  const std::lock_guard lock(mutex_);
  return aborts_;
}

gboolean FakeInstrument::OnIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  // The client is this very process: its pointers are good here.
  void* argument = *reinterpret_cast<void**>(umockdev_ioctl_client_get_arg(client)->data);
  const int error = static_cast<FakeInstrument*>(self)->Answer(
      umockdev_ioctl_client_get_request(client), argument);
  umockdev_ioctl_client_complete(client, error ? -1 : 0, error);
  return TRUE;
}

int FakeInstrument::Answer(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  if (gone_ && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_RELEASEINTERFACE &&
      request != USBDEVFS_DISCARDURB)
    return ENODEV;
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      *static_cast<unsigned*>(argument) = USBDEVFS_CAP_BULK_CONTINUATION |
                                          USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                          USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      return 0;
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:  // detach a driver: there is none
      return ENODATA;
    case USBDEVFS_CLEAR_HALT:
      faults_.stall_out = false;
      return 0;
    case USBDEVFS_GET_SPEED:
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
      return 0;
    case USBDEVFS_SUBMITURB:
      return Submit(static_cast<usbdevfs_urb*>(argument));
    case USBDEVFS_DISCARDURB: {
      const auto found = std::find(waiting_.begin(), waiting_.end(), argument);
      if (found == waiting_.end()) return EINVAL;
      Finish(*found, -ENOENT, 0);
      waiting_.erase(found);
      return 0;
    }
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      if (gone_)
        for (; !waiting_.empty(); waiting_.pop_front()) Finish(waiting_.front(), -ESHUTDOWN, 0);
      if (done_.empty()) return gone_ ? ENODEV : EAGAIN;
      *static_cast<void**>(argument) = done_.front();
      done_.pop_front();
      return 0;
    default:
      return ENOTTY;
  }
}

void FakeInstrument::Finish(usbdevfs_urb* urb, int status, std::size_t size) {
  urb->status = status;
  urb->actual_length = static_cast<int>(size);
  done_.push_back(urb);
}

int FakeInstrument::Submit(usbdevfs_urb* urb) {
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) return Control(urb);
  if (urb->endpoint & 0x80) {
    waiting_.push_back(urb);
    ServeIn();
    return 0;
  }
  if (faults_.stall_out) {
    Finish(urb, -EPIPE, 0);
    return 0;
  }
  Out(static_cast<const std::uint8_t*>(urb->buffer), static_cast<std::size_t>(urb->buffer_length));
  Finish(urb, 0, static_cast<std::size_t>(urb->buffer_length));
  ServeIn();
  return 0;
}

int FakeInstrument::Control(usbdevfs_urb* urb) {
  auto* bytes = static_cast<std::uint8_t*>(urb->buffer);
  std::vector<std::uint8_t> answer;
  if (bytes[0] == 0xa1 && bytes[1] == 7) {
    answer.assign(24, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0xa1 && bytes[1] == 5) {
    ++clears_;
    reply_.clear();
    requested_ = false;
    answer = {1};
  } else if (bytes[0] == 0xa1 && bytes[1] == 6) {
    answer = {1, 0};
  } else if (bytes[0] == 0xa2 && bytes[1] == 3) {
    ++aborts_;
    reply_.clear();
    requested_ = false;
    answer = {1, tag_};
  } else if (bytes[0] == 0xa2 && bytes[1] == 4) {
    answer.assign(8, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0xa2 && (bytes[1] == 1 || bytes[1] == 2)) {
    answer.assign(bytes[1] == 1 ? 2 : 8, 0);
    answer[0] = 1;
  } else if (bytes[0] == 0x80 && bytes[1] == 6 && bytes[3] == 3) {
    // String descriptors: the languages, and the serial number "7" in UTF-16.
    answer = bytes[2] == 0 ? std::vector<std::uint8_t>{4, 3, 9, 4}
                           : std::vector<std::uint8_t>{4, 3, '7', 0};
  } else {
    Finish(urb, -EPIPE, 0);
    return 0;
  }
  const std::size_t size =
      std::min<std::size_t>(answer.size(), static_cast<std::size_t>(urb->buffer_length) - 8);
  std::memcpy(bytes + 8, answer.data(), size);
  Finish(urb, 0, size);
  return 0;
}

void FakeInstrument::Out(const std::uint8_t* bytes, std::size_t size) {
  if (size < 12 || (bytes[1] ^ bytes[2]) != 0xff || bytes[1] == 0) return;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes + 4, 4);
  tag_before_ = std::exchange(tag_, bytes[1]);
  if (bytes[0] == 1 && size == (12 + length + 3) / 4 * 4) {
    messages_.emplace_back(reinterpret_cast<const char*>(bytes) + 12, length);
    reply_ += answer_(messages_.back());
  } else if (bytes[0] == 2) {
    requested_ = true;
    room_ = length;
  }
}

void FakeInstrument::ServeIn() {
  if (faults_.mute || !requested_ || reply_.empty() || waiting_.empty()) return;
  usbdevfs_urb* urb = waiting_.front();
  waiting_.pop_front();
  const std::size_t size = std::min<std::size_t>({reply_.size(), room_, faults_.at_once});
  const std::uint8_t tag = faults_.stale_tag ? tag_before_ : tag_;
  std::vector<std::uint8_t> transfer = {2, tag, static_cast<std::uint8_t>(~tag), 0};
  for (int shift = 0; shift < 32; shift += 8)
    transfer.push_back(static_cast<std::uint8_t>(size >> shift));
  transfer.insert(transfer.end(), {std::uint8_t{size == reply_.size()}, 0, 0, 0});
  transfer.insert(transfer.end(), reply_.begin(),
                  reply_.begin() + static_cast<std::ptrdiff_t>(size));
  if (faults_.cut) transfer.pop_back();
  reply_.erase(0, size);
  requested_ = false;
  std::memcpy(urb->buffer, transfer.data(), transfer.size());
  Finish(urb, 0, transfer.size());
}

}  // namespace luxfield::hal::usbtmc
