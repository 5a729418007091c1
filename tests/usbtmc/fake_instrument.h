// A USBTMC instrument that exists under umockdev only: the kernel's usbfs and the instrument behind
// it, for the real libusb in this process and in its children. Run the test program under
// umockdev-wrapper.
#pragma once

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace luxfield::hal::usbtmc {

class FakeInstrument {
 public:
  static constexpr std::uint16_t kVendor = 0x1209, kProduct = 0x0001;

  // `answer` gives the reply to a message, empty: none.
  explicit FakeInstrument(std::function<std::string(const std::string&)> answer);
  // On a testbed with other devices, with a product number of its own: 1 to 99.
  FakeInstrument(UMockdevTestbed* testbed, int product,
                 std::function<std::string(const std::string&)> answer);
  ~FakeInstrument();
  FakeInstrument(const FakeInstrument&) = delete;
  FakeInstrument& operator=(const FakeInstrument&) = delete;

  struct Faults {
    bool mute = false;           // it takes requests and never answers
    bool stall_out = false;      // it refuses messages, until its endpoint is cleared
    bool stale_tag = false;      // replies carry the tag of the request before
    std::size_t at_once = 1024;  // payload bytes in one transfer
    bool cut = false;            // transfers end before their payload does
  };
  void Set(const Faults& faults);
  // Lets `action` damage each transfer of a reply, called from umockdev's thread; false: it is
  // lost.
  using Damage = std::function<bool(std::vector<std::uint8_t>& transfer)>;
  void SetDamage(Damage action);
  void Unplug();
  void Plug();  // in again

  std::vector<std::string> messages();  // that came, in order
  int clears();                         // INITIATE_CLEAR
  int aborts();                         // INITIATE_ABORT_BULK_IN

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
  void Control(const Transfer& transfer);
  void Out(const std::uint8_t* bytes, std::size_t size);
  void ServeIn();
  void Finish(const Transfer& transfer, int status, std::size_t size);
  void Forget();

  std::string path_, sys_path_;
  std::function<std::string(const std::string&)> answer_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;

  std::mutex mutex_;  // of what follows
  Faults faults_;
  Damage damage_;
  bool gone_ = false;
  std::deque<Transfer> done_, waiting_;
  std::string reply_;
  bool requested_ = false;
  std::uint8_t tag_ = 0, tag_before_ = 0;
  std::uint32_t room_ = 0;
  std::vector<std::string> messages_;
  int clears_ = 0, aborts_ = 0;
};

}  // namespace luxfield::hal::usbtmc
