// Lines of a GPIO chip over libgpiod: 1.6, which speaks the kernel's v1 interface, or 2.x. One of
// gpio_lines_v1.cc and gpio_lines_v2.cc is compiled, by what the installed library offers (CMake
// looks for gpiod_chip_request_lines).
//
// Chips are named by their path, or by its last part ("gpiochip0"); lines by their name, or by
// their offset ("17"). All calls return at once. Errors are hal::HardwareError: kDisconnected for a
// chip that is not there or went away, kRefused for a line that another program holds, that does
// not exist or that cannot detect edges, or for missing permission.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace luxfield::hal::gpiod {

enum class Bias { kAsIs, kPullUp, kPullDown, kDisabled };

struct LineSettings {
  std::string line;
  bool active_low = false;  // a low pin reads, or is written, as active
  Bias bias = Bias::kAsIs;
};

// Its label and how many lines it has: "pinctrl-bcm2711, 58 lines".
std::string DescribeChip(const std::string& chip);

// Input lines with edge detection, held until destruction.
class InputLines {
 public:
  InputLines(const std::string& chip, const std::vector<LineSettings>& lines);
  ~InputLines();
  InputLines(const InputLines&) = delete;
  InputLines& operator=(const InputLines&) = delete;

  // The pins as they are now, in the order of the lines; true: active. Not what the queue of edges
  // says: the kernel keeps only the last 16 of a line.
  std::vector<bool> Levels() const;
  // Readable while edges are queued.
  std::vector<int> edge_fds() const;
  // Takes what is queued.
  void DrainEdges();

 private:
  struct Request;
  std::unique_ptr<Request> request_;
};

// An output line, held until destruction. What the pin does afterwards is up to its chip.
class OutputLine {
 public:
  OutputLine(const std::string& chip, const LineSettings& line, bool active);
  ~OutputLine();
  OutputLine(const OutputLine&) = delete;
  OutputLine& operator=(const OutputLine&) = delete;

  void Set(bool active);
  bool Get() const;  // read back from the chip

 private:
  struct Request;
  std::unique_ptr<Request> request_;
};

}  // namespace luxfield::hal::gpiod
