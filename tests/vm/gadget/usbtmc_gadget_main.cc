// usbtmc_gadget FOLDER: a USBTMC instrument, a SCPI supply, as the kernel's FunctionFS plays it on
// a USB device controller; FOLDER is where the FunctionFS is mounted. Says "ready" when the
// function can be bound to a controller, then "message" and "asked" for what comes over bulk OUT.
// Takes commands, a line each, and says "obeyed": "mute", "answer" (no fault), "stall" (the next
// transfer that it takes is the last), "at once N". Ends with its input.
#include <fcntl.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include "tests/usbtmc/device_side.h"
#include "tests/usbtmc/fake_supply.h"

namespace luxfield::vm {
namespace {

using hal::usbtmc::DeviceSide;

// The interface of a USBTMC/USB488 instrument with a bulk endpoint each way.
struct [[gnu::packed]] Interface {
  usb_interface_descriptor interface;
  usb_endpoint_descriptor_no_audio in, out;
};
Interface Describe(std::uint16_t packet) {
  const auto endpoint = [packet](int address) {
    return usb_endpoint_descriptor_no_audio{sizeof(usb_endpoint_descriptor_no_audio),
                                            USB_DT_ENDPOINT,
                                            static_cast<__u8>(address),
                                            USB_ENDPOINT_XFER_BULK,
                                            htole16(packet),
                                            0};
  };
  return {{sizeof(usb_interface_descriptor), USB_DT_INTERFACE, 0, 0, 2, 0xfe, 3, 1, 0},
          endpoint(USB_DIR_IN | 1),
          endpoint(USB_DIR_OUT | 2)};
}

int Open(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) throw std::system_error(errno, std::generic_category(), path);
  return file;
}

template <typename T>
void Write(int file, const T& bytes, const char* what) {
  if (write(file, &bytes, sizeof bytes) != sizeof bytes)
    throw std::system_error(errno, std::generic_category(), what);
}

void Say(const char* word) { std::cout << word << std::endl; }

class Gadget {
 public:
  explicit Gadget(const std::string& folder) : control_(Open(folder + "/ep0")) {
    struct [[gnu::packed]] {
      usb_functionfs_descs_head_v2 head;
      __le32 full_count, high_count;
      Interface full, high;
    } descriptors{{htole32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2), htole32(sizeof descriptors),
                   htole32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC)},
                  htole32(3),
                  htole32(3),
                  Describe(64),
                  Describe(512)};
    Write(control_, descriptors, "descriptors");
    const usb_functionfs_strings_head strings{htole32(FUNCTIONFS_STRINGS_MAGIC),
                                              htole32(sizeof strings), 0, 0};
    Write(control_, strings, "strings");
    in_ = Open(folder + "/ep1");
    out_ = Open(folder + "/ep2");
    std::thread([this] { ServeControl(); }).detach();
    std::thread([this] { ServeMessages(); }).detach();
    Say("ready");
  }

  bool Obey(const std::string& command) {
    const std::lock_guard lock(mutex_);
    if (command == "answer")
      side_.faults = {};
    else if (command == "mute")
      side_.faults.mute = true;
    else if (command == "stall")
      side_.faults.stall_out = true;
    else if (command.starts_with("at once "))
      side_.faults.at_once = std::stoul(command.substr(8));
    else
      return false;
    Say("obeyed");
    return true;
  }

 private:
  [[noreturn]] void Fail(const char* what) {
    std::perror(what);
    std::_Exit(1);
  }

  void ServeControl() {
    usb_functionfs_event event;
    while (read(control_, &event, sizeof event) == sizeof event) {
      if (event.type != FUNCTIONFS_SETUP) continue;
      const usb_ctrlrequest& setup = event.u.setup;
      std::optional<DeviceSide::Bytes> answer;
      {
        const std::lock_guard lock(mutex_);
        answer = side_.Control(reinterpret_cast<const std::uint8_t*>(&setup));
      }
      // A transfer in the direction that was not asked for stalls the endpoint.
      const bool reads = setup.bRequestType & USB_DIR_IN;
      char none = 0;
      if (answer && reads)
        answer->resize(std::min<std::size_t>(answer->size(), le16toh(setup.wLength)));
      const ssize_t moved = !answer ? (reads ? read(control_, &none, 0) : write(control_, &none, 0))
                                    : write(control_, answer->data(), answer->size());
      if (moved < 0 && errno != EL2HLT && errno != EIDRM) Fail("control");
    }
    Fail("control events");
  }

  void ServeMessages() {
    for (;;) {
      DeviceSide::Bytes transfer(4096);
      const ssize_t got = read(out_, transfer.data(), transfer.size());
      // The plug was pulled; the next read waits until it is in again.
      if (got < 0 && (errno == ESHUTDOWN || errno == ENODEV)) continue;
      if (got < 0) Fail("bulk out");
      std::optional<DeviceSide::Bytes> reply;
      bool accepted = false;
      {
        const std::lock_guard lock(mutex_);
        accepted = side_.Out(transfer.data(), static_cast<std::size_t>(got));
        side_.faults.stall_out = false;
        reply = side_.In();
      }
      Say(transfer[0] == 2 ? "asked" : "message");
      if (!accepted)
        Stall();
      else if (reply)
        Reply(*reply);
    }
  }

  void Stall() {
    char none = 0;
    if (write(out_, &none, 0) < 0 && errno != EBADMSG) Fail("stall");
  }

  void Reply(const DeviceSide::Bytes& transfer) {
    if (write(in_, transfer.data(), transfer.size()) < 0) {
      if (errno == ESHUTDOWN || errno == ENODEV) return;
      Fail("bulk in");
    }
    // A short packet ends a transfer, be it an empty one.
    char none = 0;
    if (transfer.size() % 512 == 0 && write(in_, &none, 0) < 0) Fail("bulk in");
  }

  int control_ = -1, in_ = -1, out_ = -1;
  std::mutex mutex_;  // of what follows
  hal::scpi::FakeSupply supply_;
  DeviceSide side_{[this](const std::string& message) {
    return message == "LONG?\n" ? std::string(5000, 'x') + "\n" : supply_.Answer(message);
  }};
};

}  // namespace
}  // namespace luxfield::vm

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: usbtmc_gadget FOLDER\n";
    return 2;
  }
  try {
    auto* gadget = new luxfield::vm::Gadget(argv[1]);  // its threads end with the process
    for (std::string command; std::getline(std::cin, command);)
      if (!gadget->Obey(command)) std::cerr << "unknown command: " << command << "\n";
    std::_Exit(0);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
