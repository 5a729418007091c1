#include "tests/vm/serial_adapter.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "tests/vm/await.h"

namespace luxfield::vm {
namespace {

bool Present() { return std::filesystem::exists(SerialAdapter::kPort); }

// The kernel makes the port's name a moment before the port can be opened.
bool Ready() {
  const int file = open(SerialAdapter::kPort, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  return file >= 0 && close(file) == 0;
}

int OpenMonitor() {
  const int file = open("/dev/vport0p1", O_RDWR | O_CLOEXEC);
  if (file < 0) throw std::system_error(errno, std::generic_category(), "QEMU's monitor");
  return file;
}

}  // namespace

SerialAdapter::SerialAdapter() : monitor_(OpenMonitor(), "QEMU's monitor"), replies_(monitor_) {
  Ask(R"({"execute": "qmp_capabilities"})");  // refused where an adapter before this one asked
  if (!Present())
    Plug();
  else if (!Await(Ready))
    throw std::runtime_error("the adapter does not open");
}

nlohmann::json SerialAdapter::Ask(const std::string& command) {
  monitor_.Write(command + "\n", hal::SecondsFromNow(30));
  while (const auto line = replies_.Next(hal::SecondsFromNow(30))) {
    auto reply = nlohmann::json::parse(*line, nullptr, false);
    if (reply.is_object() && (reply.contains("return") || reply.contains("error"))) return reply;
  }
  throw std::runtime_error("QEMU does not answer " + command);
}

void SerialAdapter::Unplug() {
  const auto reply = Ask(R"({"execute": "device_del", "arguments": {"id": "stage"}})");
  if (!reply.contains("return")) throw std::runtime_error("QEMU answers " + reply.dump());
  if (!Await([] { return !Present(); })) throw std::runtime_error("the adapter stays");
}

void SerialAdapter::Plug() {
  // Refused until QEMU has taken down the device that was pulled out.
  const auto added = [this] {
    return Ask(R"({"execute": "device_add", "arguments":
                   {"driver": "usb-serial", "id": "stage", "chardev": "stage-line"}})")
        .contains("return");
  };
  if (!Await(added) || !Await(Ready)) throw std::runtime_error("the adapter is not seen");
}

}  // namespace luxfield::vm
