// A USBTMC instrument on the kernel's dummy_hcd, host and device controller with a wire between
// them: the program usbtmc_gadget behind a FunctionFS.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace luxfield::vm {

class UsbInstrument {
 public:
  static constexpr std::uint16_t kVendor = 0x1209, kProduct = 0x0001;

  UsbInstrument();  // plugged in, and seen by the host
  ~UsbInstrument();
  UsbInstrument(const UsbInstrument&) = delete;
  UsbInstrument& operator=(const UsbInstrument&) = delete;

  void Unplug();
  void Plug();
  void Tell(const std::string& command);  // usbtmc_gadget's; it has obeyed when this returns
  // Reads what it says up to the word.
  void AwaitWord(const std::string& word);

 private:
  void Start();

  std::filesystem::path config_, functions_;
  pid_t child_ = -1;
  int commands_ = -1, words_ = -1;
};

}  // namespace luxfield::vm
