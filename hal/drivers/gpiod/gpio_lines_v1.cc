#include "luxfield/hal/drivers/gpiod/gpio_lines.h"

#if LUXFIELD_LIBGPIOD == 1

#include <fmt/format.h>
#include <gpiod.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <charconv>

#include "luxfield/hal/drivers/gpiod/gpio_error.h"

namespace luxfield::hal::gpiod {
namespace {

constexpr const char* kConsumer = "luxfield";

struct ChipCloser {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }  // releases its lines
};
using Chip = std::unique_ptr<gpiod_chip, ChipCloser>;

Chip Open(const std::string& name) {
  Chip chip(gpiod_chip_open(ChipPath(name).c_str()));
  if (!chip) throw GpioError(name, "open", errno);
  return chip;
}

gpiod_line* Find(const Chip& chip, const std::string& chip_name, const std::string& line) {
  unsigned offset = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), offset);
  const bool is_offset = error == std::errc() && end == line.data() + line.size();
  gpiod_line* found = is_offset ? gpiod_chip_get_line(chip.get(), offset)
                                : gpiod_chip_find_line(chip.get(), line.c_str());
  if (found) return found;
  std::string names;
  for (unsigned k = 0; k < gpiod_chip_num_lines(chip.get()); ++k)
    if (gpiod_line* other = gpiod_chip_get_line(chip.get(), k))
      if (const char* name = gpiod_line_name(other)) {
        if (!names.empty()) names += ", ";
        names += name;
      }
  throw NoSuchLine(chip_name, line, names);
}

int Flags(const LineSettings& settings) {
  constexpr std::array kBias = {0, static_cast<int>(GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP),
                                static_cast<int>(GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN),
                                static_cast<int>(GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE)};
  return kBias[static_cast<std::size_t>(settings.bias)] |
         (settings.active_low ? static_cast<int>(GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW) : 0);
}

// Why a request of a line was refused, by errno.
HardwareError Refused(const std::string& chip, const std::string& operation,
                      const std::string& name, gpiod_line* line) {
  if (errno != EBUSY) return GpioError(chip, operation, errno);
  gpiod_line_update(line);  // its user may have come since it was found
  const char* holder = gpiod_line_consumer(line);
  return LineHeld(chip, operation, name, holder ? holder : "");
}

}  // namespace

std::string DescribeChip(const std::string& chip) {
  const Chip opened = Open(chip);
  return fmt::format("{}, {} lines", gpiod_chip_label(opened.get()),
                     gpiod_chip_num_lines(opened.get()));
}

struct InputLines::Request {
  std::string chip_name;
  Chip chip;
  std::vector<gpiod_line*> lines;
};

InputLines::InputLines(const std::string& chip, const std::vector<LineSettings>& lines)
    : request_(std::make_unique<Request>()) {
  request_->chip_name = chip;
  request_->chip = Open(chip);
  for (const LineSettings& settings : lines) {
    gpiod_line* line = Find(request_->chip, chip, settings.line);
    if (gpiod_line_request_both_edges_events_flags(line, kConsumer, Flags(settings)) != 0)
      throw Refused(chip, "request input line " + settings.line, settings.line, line);
    request_->lines.push_back(line);
  }
}

InputLines::~InputLines() = default;

std::vector<bool> InputLines::Levels() const {
  std::vector<bool> levels;
  for (gpiod_line* line : request_->lines) {
    const int value = gpiod_line_get_value(line);
    if (value < 0) throw GpioError(request_->chip_name, "read input lines", errno);
    levels.push_back(value == 1);
  }
  return levels;
}

std::vector<int> InputLines::edge_fds() const {
  std::vector<int> fds;
  for (gpiod_line* line : request_->lines) fds.push_back(gpiod_line_event_get_fd(line));
  return fds;
}

void InputLines::DrainEdges() {
  for (gpiod_line* line : request_->lines) {
    pollfd ready{gpiod_line_event_get_fd(line), POLLIN, 0};
    std::array<gpiod_line_event, 16> events;
    while (poll(&ready, 1, 0) == 1) {
      if (!(ready.revents & POLLIN)) throw GpioError(request_->chip_name, "read edges", ENODEV);
      if (gpiod_line_event_read_multiple(line, events.data(), events.size()) < 0)
        throw GpioError(request_->chip_name, "read edges", errno);
    }
  }
}

struct OutputLine::Request {
  std::string chip_name;
  Chip chip;
  gpiod_line* line = nullptr;
};

OutputLine::OutputLine(const std::string& chip, const LineSettings& settings, bool active)
    : request_(std::make_unique<Request>()) {
  request_->chip_name = chip;
  request_->chip = Open(chip);
  request_->line = Find(request_->chip, chip, settings.line);
  if (gpiod_line_request_output_flags(request_->line, kConsumer, Flags(settings), active) != 0)
    throw Refused(chip, "request output line " + settings.line, settings.line, request_->line);
}

OutputLine::~OutputLine() = default;

void OutputLine::Set(bool active) {
  if (gpiod_line_set_value(request_->line, active) != 0)
    throw GpioError(request_->chip_name, "set output line", errno);
}

bool OutputLine::Get() const {
  const int value = gpiod_line_get_value(request_->line);
  if (value < 0) throw GpioError(request_->chip_name, "read back output line", errno);
  return value == 1;
}

}  // namespace luxfield::hal::gpiod

#endif
