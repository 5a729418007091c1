#include "tests/vm/usb_instrument.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "tests/vm/attribute.h"
#include "tests/vm/await.h"

namespace luxfield::vm {
namespace fs = std::filesystem;
namespace {

constexpr const char* kController = "dummy_udc.0";

// Whether a device of the host has our numbers. One that goes while it is looked at has not.
bool IsOurs(const fs::path& device) {
  try {
    return ReadAttribute(device / "idVendor") == fmt::format("{:04x}", UsbInstrument::kVendor);
  } catch (const std::system_error&) {  // an interface, which has none, or gone
    return false;
  }
}

bool Seen() {
  const fs::directory_iterator devices("/sys/bus/usb/devices");
  return std::any_of(begin(devices), end(devices),
                     [](const fs::directory_entry& device) { return IsOurs(device.path()); });
}

}  // namespace

UsbInstrument::UsbInstrument()
    : config_("/sys/kernel/config/usb_gadget/instrument"), functions_("/tmp/functions") {
  fs::create_directory(config_);
  WriteAttribute(config_ / "idVendor", fmt::format("0x{:04x}", kVendor));
  WriteAttribute(config_ / "idProduct", fmt::format("0x{:04x}", kProduct));
  fs::create_directory(config_ / "strings/0x409");
  WriteAttribute(config_ / "strings/0x409/serialnumber", "7");
  fs::create_directory(config_ / "configs/c.1");
  fs::create_directory(config_ / "functions/ffs.instrument");
  fs::create_directory_symlink(config_ / "functions/ffs.instrument",
                               config_ / "configs/c.1/ffs.instrument");
  fs::create_directories(functions_);
  if (mount("instrument", functions_.c_str(), "functionfs", 0, nullptr) != 0)
    throw std::system_error(errno, std::generic_category(), "mount functionfs");
  Start();
  AwaitWord("ready");
  Plug();
}

void UsbInstrument::Start() {
  std::array<int, 2> in{}, out{};
  if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::system_error(errno, std::generic_category(), "pipe");
  child_ = fork();
  if (child_ == 0) {
    dup2(in[0], STDIN_FILENO);
    dup2(out[1], STDOUT_FILENO);
    execl("/tests/usbtmc_gadget", "usbtmc_gadget", functions_.c_str(), nullptr);
    _exit(127);
  }
  close(in[0]);
  close(out[1]);
  commands_ = in[1];
  words_ = out[0];
}

UsbInstrument::~UsbInstrument() {
  try {
    if (!ReadAttribute(config_ / "UDC").empty()) Unplug();
    close(commands_);
    waitpid(child_, nullptr, 0);
    close(words_);
    umount(functions_.c_str());
    fs::remove(config_ / "configs/c.1/ffs.instrument");
    for (const char* folder : {"configs/c.1", "functions/ffs.instrument", "strings/0x409"})
      rmdir((config_ / folder).c_str());
    rmdir(config_.c_str());
  } catch (const std::exception& error) {
    fmt::print(stderr, "the gadget stays: {}\n", error.what());
  }
}

void UsbInstrument::Plug() {
  WriteAttribute(config_ / "UDC", kController);
  if (!Await(Seen)) throw std::runtime_error("the host does not see the instrument");
}

void UsbInstrument::Unplug() {
  WriteAttribute(config_ / "UDC", "");
  if (!Await([] { return !Seen(); })) throw std::runtime_error("the instrument stays");
}

void UsbInstrument::Tell(const std::string& command) {
  const std::string line = command + "\n";
  if (write(commands_, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    throw std::system_error(errno, std::generic_category(), "tell the gadget");
  AwaitWord("obeyed");
}

void UsbInstrument::AwaitWord(const std::string& word) {
  for (std::string line;;) {
    char c = 0;
    if (read(words_, &c, 1) != 1) throw std::runtime_error("the gadget has ended");
    if (c != '\n') {
      line += c;
      continue;
    }
    if (line == word) return;
    line.clear();
  }
}

}  // namespace luxfield::vm
