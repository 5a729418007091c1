#include "tests/usbtmc/fake_instrument.h"

#include <fmt/format.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace luxfield::hal::usbtmc {
namespace {

// Device 1209:PRODUCT with a serial number, one configuration, one USBTMC/USB488 interface with a
// bulk endpoint each way of 512 bytes.
std::string Record(int product, const std::string& path, const std::string& sys_path) {
  const std::uint8_t descriptors[] = {
      18,   1,    0x00, 0x02, 0,    0,    0, 64,   0x09, 0x12, static_cast<std::uint8_t>(product),
      0x00, 0x00, 0x01, 0,    0,    3,    1,            //
      9,    2,    32,   0,    1,    1,    0, 0x80, 50,  //
      9,    4,    0,    0,    2,    0xfe, 3, 1,    0,   //
      7,    5,    0x81, 2,    0x00, 0x02, 0,            //
      7,    5,    0x02, 2,    0x00, 0x02, 0};
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

FakeInstrument::FakeInstrument(std::function<std::string(const std::string&)> answer)
    : FakeInstrument(umockdev_testbed_new(), kProduct, std::move(answer)) {
  g_object_unref(testbed_);  // the other constructor holds it too
}

FakeInstrument::FakeInstrument(UMockdevTestbed* testbed, int product,
                               std::function<std::string(const std::string&)> answer)
    : path_(fmt::format("/dev/bus/usb/001/{:03}", product + 1)),
      sys_path_(fmt::format("/sys/devices/pci0000:00/usb1/1-{}", product)),
      answer_(std::move(answer)),
      testbed_(UMOCKDEV_TESTBED(g_object_ref(testbed))),
      handler_(umockdev_ioctl_base_new()) {
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_, Record(product, path_, sys_path_).c_str(), &error);
  Check(error);
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(OnIoctl), this);
  umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), handler_, &error);
  Check(error);
}

FakeInstrument::~FakeInstrument() {
  g_object_unref(handler_);
  g_object_unref(testbed_);
  Forget();
}

void FakeInstrument::Set(const Faults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

void FakeInstrument::SetDamage(Damage action) {
  const std::lock_guard lock(mutex_);
  damage_ = std::move(action);
}

void FakeInstrument::Unplug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = true;
  }
  umockdev_testbed_uevent(testbed_, sys_path_.c_str(), "remove");
}

void FakeInstrument::Plug() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = false;
  }
  umockdev_testbed_uevent(testbed_, sys_path_.c_str(), "add");
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
  const int error = static_cast<FakeInstrument*>(self)->Answer(
      umockdev_ioctl_client_get_request(client), umockdev_ioctl_client_get_arg(client));
  umockdev_ioctl_client_complete(client, error ? -1 : 0, error);
  return TRUE;
}

int FakeInstrument::Answer(unsigned long request, UMockdevIoctlData* argument) {
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
      faults_.stall_out = false;
      return 0;
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      Forget();  // what a program left that was killed
      return 0;
    case USBDEVFS_GET_SPEED:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
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

void FakeInstrument::Forget() {
  for (std::deque<Transfer>* queue : {&done_, &waiting_}) {
    for (Transfer& transfer : *queue) {
      g_clear_object(&transfer.buffer);
      g_object_unref(transfer.urb);
    }
    queue->clear();
  }
}

int FakeInstrument::Reap(UMockdevIoctlData* argument) {
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

int FakeInstrument::Discard(UMockdevIoctlData* argument) {
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

void FakeInstrument::Finish(const Transfer& transfer, int status, std::size_t size) {
  transfer.fields()->status = status;
  transfer.fields()->actual_length = static_cast<int>(size);
  done_.push_back(transfer);
}

int FakeInstrument::Submit(UMockdevIoctlData* argument) {
  Transfer transfer;
  transfer.urb = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
  if (!transfer.urb) return EFAULT;
  transfer.buffer = umockdev_ioctl_data_resolve(transfer.urb, offsetof(usbdevfs_urb, buffer),
                                                transfer.size(), nullptr);
  const usbdevfs_urb& urb = *transfer.fields();
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    Control(transfer);
  } else if (urb.endpoint & 0x80) {
    waiting_.push_back(transfer);
    ServeIn();
  } else if (faults_.stall_out) {
    Finish(transfer, -EPIPE, 0);
  } else {
    Out(transfer.bytes(), transfer.size());
    Finish(transfer, 0, transfer.size());
    ServeIn();
  }
  return 0;
}

void FakeInstrument::Control(const Transfer& transfer) {
  std::uint8_t* bytes = transfer.bytes();
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
    Finish(transfer, -EPIPE, 0);
    return;
  }
  const std::size_t size = std::min<std::size_t>(answer.size(), transfer.size() - 8);
  std::memcpy(bytes + 8, answer.data(), size);
  Finish(transfer, 0, size);
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
  const Transfer in = waiting_.front();
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
  if (damage_ && !damage_(transfer)) {
    waiting_.push_front(in);
    return;
  }
  transfer.resize(std::min(transfer.size(), in.size()));
  std::memcpy(in.bytes(), transfer.data(), transfer.size());
  Finish(in, 0, transfer.size());
}

}  // namespace luxfield::hal::usbtmc
