#include "tests/usb/fake_usb_device.h"

#include <fmt/format.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace luxfield::usb {
namespace {

// Its descriptors, and what the kernel says of the device.
std::string Record(int product, const Bytes& interface, const std::string& path,
                   const std::string& sys_path) {
  Bytes descriptors = {
      18,   1,    0x00, 0x02, 0, 0, 0, 64, 0x09, 0x12, static_cast<std::uint8_t>(product),
      0x00, 0x00, 0x01, 1,    2, 3, 1};
  const auto size = static_cast<std::uint8_t>(9 + interface.size());
  descriptors.insert(descriptors.end(), {9, 2, size, 0, 1, 1, 0, 0x80, 50});
  descriptors.insert(descriptors.end(), interface.begin(), interface.end());
  std::string hex;
  for (const std::uint8_t byte : descriptors) hex += fmt::format("{:02X}", byte);
  return fmt::format(
      "P: {}\nN: {}\nE: DEVNAME={}\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=001\nE: "
      "DEVNUM={:03}\nE: MAJOR=189\nE: MINOR={}\nA: busnum=1\\n\nA: devnum={}\\n\nA: "
      "speed=480\\n\nA: bConfigurationValue=1\\n\nA: idVendor=1209\\n\nA: "
      "idProduct={:04x}\\n\nA: dev=189:{}\\n\nH: descriptors={}\n\n",
      sys_path.substr(std::strlen("/sys")), path.substr(std::strlen("/dev/")), path, product + 1,
      product, product + 1, product, product, hex);
}

void Check(GError* error) {
  if (!error) return;
  const std::string what = error->message;
  g_error_free(error);
  throw std::runtime_error("umockdev: " + what);
}

// umockdev's copy of what an ioctl's argument points to; written back when the ioctl completes.
class Resolved {
 public:
  Resolved(UMockdevIoctlData* argument, std::size_t size)
      : data_(umockdev_ioctl_data_resolve(argument, 0, size, nullptr)) {}
  ~Resolved() { g_clear_object(&data_); }
  Resolved(const Resolved&) = delete;
  Resolved& operator=(const Resolved&) = delete;

  explicit operator bool() const { return data_ != nullptr; }
  UMockdevIoctlData* get() const { return data_; }
  UMockdevIoctlData* operator->() const { return data_; }

 private:
  UMockdevIoctlData* data_;
};

}  // namespace

FakeUsbDevice::FakeUsbDevice(UMockdevTestbed* testbed, int product, const Bytes& interface,
                             Endpoints endpoints)
    : path_(fmt::format("/dev/bus/usb/001/{:03}", product + 1)),
      sys_path_(fmt::format("/sys/devices/pci0000:00/usb1/1-{}", product)),
      endpoints_(std::move(endpoints)),
      testbed_(UMOCKDEV_TESTBED(g_object_ref(testbed))),
      handler_(umockdev_ioctl_base_new()) {
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_, Record(product, interface, path_, sys_path_).c_str(),
                                   &error);
  Check(error);
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(OnIoctl), this);
  umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), handler_, &error);
  Check(error);
}

FakeUsbDevice::~FakeUsbDevice() {
  g_object_unref(handler_);
  g_object_unref(testbed_);
  Forget();
}

void FakeUsbDevice::Unplug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = true;
  }
  umockdev_testbed_uevent(testbed_, sys_path_.c_str(), "remove");
}

void FakeUsbDevice::Plug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = false;
  }
  umockdev_testbed_uevent(testbed_, sys_path_.c_str(), "add");
}

gboolean FakeUsbDevice::OnIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  const int error = static_cast<FakeUsbDevice*>(self)->Answer(
      umockdev_ioctl_client_get_request(client), umockdev_ioctl_client_get_arg(client));
  umockdev_ioctl_client_complete(client, error ? -1 : 0, error);
  return TRUE;
}

int FakeUsbDevice::Answer(unsigned long request, UMockdevIoctlData* argument) {
  const std::lock_guard lock(mutex_);
  if (gone_ && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_RELEASEINTERFACE &&
      request != USBDEVFS_DISCARDURB)
    return ENODEV;
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES: {
      const Resolved answer(argument, sizeof(std::uint32_t));
      if (!answer) return EFAULT;
      const std::uint32_t capabilities = USBDEVFS_CAP_BULK_CONTINUATION |
                                         USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                         USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      std::memcpy(answer->data, &capabilities, sizeof capabilities);
      return 0;
    }
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:  // detach a driver: there is none
      return ENODATA;
    case USBDEVFS_CLEAR_HALT:
      endpoints_.clear_halt();
      return 0;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      Forget();  // what a program left that was killed
      return 0;
    case USBDEVFS_GET_SPEED:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_RESET:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
      return 0;
    case USBDEVFS_SUBMITURB:
      return Submit(argument);
    case USBDEVFS_DISCARDURB:
      return Discard(argument);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return Reap(argument);
    default:
      return ENOTTY;
  }
}

void FakeUsbDevice::Forget() {
  for (std::deque<Transfer>* queue : {&done_, &waiting_}) {
    for (Transfer& transfer : *queue) {
      g_clear_object(&transfer.buffer);
      g_object_unref(transfer.urb);
    }
    queue->clear();
  }
}

int FakeUsbDevice::Reap(UMockdevIoctlData* argument) {
  if (gone_)
    for (; !waiting_.empty(); waiting_.pop_front()) Finish(waiting_.front(), -ESHUTDOWN, 0);
  if (done_.empty()) return gone_ ? ENODEV : EAGAIN;
  const Resolved answer(argument, sizeof(void*));
  if (!answer) return EFAULT;
  const Transfer transfer = done_.front();
  done_.pop_front();
  umockdev_ioctl_data_set_ptr(answer.get(), 0, transfer.urb);  // writes URB and buffer back
  if (transfer.buffer) g_object_unref(transfer.buffer);
  g_object_unref(transfer.urb);
  return 0;
}

int FakeUsbDevice::Discard(UMockdevIoctlData* argument) {
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof address);
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const Transfer& transfer) {
    return transfer.urb->client_addr == address;
  });
  if (found == waiting_.end()) return EINVAL;
  Finish(*found, -ENOENT, 0);
  waiting_.erase(found);
  return 0;
}

void FakeUsbDevice::Finish(const Transfer& transfer, int status, std::size_t size) {
  transfer.fields()->status = status;
  transfer.fields()->actual_length = static_cast<int>(size);
  done_.push_back(transfer);
}

int FakeUsbDevice::Submit(UMockdevIoctlData* argument) {
  Transfer transfer;
  transfer.urb = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
  if (!transfer.urb) return EFAULT;
  transfer.buffer = umockdev_ioctl_data_resolve(transfer.urb, offsetof(usbdevfs_urb, buffer),
                                                transfer.size(), nullptr);
  const usbdevfs_urb& urb = *transfer.fields();
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    constexpr std::size_t kRequest = 8;
    const auto answer = endpoints_.control(transfer.bytes());
    const std::size_t size = answer ? std::min(answer->size(), transfer.size() - kRequest) : 0;
    if (answer) std::copy_n(answer->begin(), size, transfer.bytes() + kRequest);
    Finish(transfer, answer ? 0 : -EPIPE, size);
  } else if (urb.endpoint & 0x80) {
    waiting_.push_back(transfer);
    Serve();
  } else if (endpoints_.out(urb.endpoint, transfer.bytes(), transfer.size())) {
    Finish(transfer, 0, transfer.size());
    Serve();
  } else {
    Finish(transfer, -EPIPE, 0);
  }
  return 0;
}

void FakeUsbDevice::Serve() {
  std::deque<Transfer> still;
  for (const Transfer& transfer : waiting_) {
    const auto bytes = endpoints_.in(transfer.fields()->endpoint, transfer.size());
    if (!bytes) {
      still.push_back(transfer);
      continue;
    }
    std::copy(bytes->begin(), bytes->end(), transfer.bytes());
    Finish(transfer, 0, bytes->size());
  }
  waiting_ = std::move(still);
}

}  // namespace luxfield::usb
