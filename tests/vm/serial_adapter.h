// The FTDI serial adapter that QEMU plays in the virtual machine of tests/vm/boot, a Grbl
// controller at the other end of its line; its plug is pulled through QEMU's monitor (QMP), which
// the machine's virtio port leads to.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/hal/transport/descriptor_stream.h"
#include "luxfield/hal/transport/line_reader.h"

namespace luxfield::vm {

class SerialAdapter {
 public:
  static constexpr const char* kPort = "/dev/ttyUSB0";

  SerialAdapter();  // plugged in

  void Unplug();
  void Plug();

 private:
  nlohmann::json Ask(const std::string& command);

  hal::DescriptorStream monitor_;
  hal::LineReader replies_;
};

}  // namespace luxfield::vm
