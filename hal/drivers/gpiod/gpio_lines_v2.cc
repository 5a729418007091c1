#include "luxfield/hal/drivers/gpiod/gpio_lines.h"

#if LUXFIELD_LIBGPIOD == 2

#include <fmt/format.h>
#include <gpiod.h>

#include <array>
#include <cerrno>
#include <charconv>

#include "luxfield/hal/drivers/gpiod/gpio_error.h"

namespace luxfield::hal::gpiod {
namespace {

constexpr const char* kConsumer = "luxfield";
constexpr std::size_t kEdgesAtOnce = 64;

template <auto free>
struct Freer {
  template <typename T>
  void operator()(T* object) const {
    free(object);
  }
};
template <typename T, auto free>
using Owned = std::unique_ptr<T, Freer<free>>;

using Chip = Owned<gpiod_chip, gpiod_chip_close>;
using LineInfo = Owned<gpiod_line_info, gpiod_line_info_free>;
using Settings = Owned<gpiod_line_settings, gpiod_line_settings_free>;
using LineConfig = Owned<gpiod_line_config, gpiod_line_config_free>;
using RequestConfig = Owned<gpiod_request_config, gpiod_request_config_free>;
using LineRequest = Owned<gpiod_line_request, gpiod_line_request_release>;
using EdgeBuffer = Owned<gpiod_edge_event_buffer, gpiod_edge_event_buffer_free>;

Chip Open(const std::string& name) {
  Chip chip(gpiod_chip_open(ChipPath(name).c_str()));
  if (!chip) throw GpioError(name, "open", errno);
  return chip;
}

using ChipInfo = Owned<gpiod_chip_info, gpiod_chip_info_free>;

ChipInfo InfoOf(const Chip& chip, const std::string& name) {
  ChipInfo info(gpiod_chip_get_info(chip.get()));
  if (!info) throw GpioError(name, "open", errno);
  return info;
}

unsigned NumberOfLines(const Chip& chip, const std::string& name) {
  return static_cast<unsigned>(gpiod_chip_info_get_num_lines(InfoOf(chip, name).get()));
}

unsigned FindOffset(const Chip& chip, const std::string& chip_name, const std::string& line) {
  const unsigned count = NumberOfLines(chip, chip_name);
  unsigned offset = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), offset);
  if (error == std::errc() && end == line.data() + line.size()) {
    if (offset < count) return offset;
  } else if (const int found = gpiod_chip_get_line_offset_from_name(chip.get(), line.c_str());
             found >= 0) {
    return static_cast<unsigned>(found);
  }
  std::string names;
  for (unsigned k = 0; k < count; ++k) {
    const LineInfo info(gpiod_chip_get_line_info(chip.get(), k));
    if (const char* name = info ? gpiod_line_info_get_name(info.get()) : nullptr) {
      if (!names.empty()) names += ", ";
      names += name;
    }
  }
  throw NoSuchLine(chip_name, line, names);
}

Settings MakeSettings(const LineSettings& line) {
  constexpr std::array kBias = {GPIOD_LINE_BIAS_AS_IS, GPIOD_LINE_BIAS_PULL_UP,
                                GPIOD_LINE_BIAS_PULL_DOWN, GPIOD_LINE_BIAS_DISABLED};
  Settings settings(gpiod_line_settings_new());
  if (!settings) throw std::bad_alloc();
  gpiod_line_settings_set_bias(settings.get(), kBias[static_cast<std::size_t>(line.bias)]);
  gpiod_line_settings_set_active_low(settings.get(), line.active_low);
  return settings;
}

// A line to request.
struct Wish {
  std::string name;
  unsigned offset;
  Settings settings;
};

LineRequest RequestLines(const Chip& chip, const std::string& chip_name,
                         const std::vector<Wish>& wishes, const std::string& operation) {
  const LineConfig lines(gpiod_line_config_new());
  const RequestConfig config(gpiod_request_config_new());
  if (!lines || !config) throw std::bad_alloc();
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  for (const Wish& wish : wishes)
    if (gpiod_line_config_add_line_settings(lines.get(), &wish.offset, 1, wish.settings.get()) != 0)
      throw GpioError(chip_name, operation, errno);
  LineRequest request(gpiod_chip_request_lines(chip.get(), config.get(), lines.get()));
  if (request) return request;
  const int error = errno;
  if (error == EBUSY)
    for (const Wish& wish : wishes) {
      const LineInfo info(gpiod_chip_get_line_info(chip.get(), wish.offset));
      if (!info || !gpiod_line_info_is_used(info.get())) continue;
      const char* holder = gpiod_line_info_get_consumer(info.get());
      throw LineHeld(chip_name, operation, wish.name, holder ? holder : "");
    }
  throw GpioError(chip_name, operation, error);
}

}  // namespace

std::string DescribeChip(const std::string& chip) {
  const ChipInfo info = InfoOf(Open(chip), chip);
  return fmt::format("{}, {} lines", gpiod_chip_info_get_label(info.get()),
                     gpiod_chip_info_get_num_lines(info.get()));
}

struct InputLines::Request {
  std::string chip_name;
  LineRequest lines;
  EdgeBuffer edges;
  std::vector<unsigned> offsets;
};

InputLines::InputLines(const std::string& chip_name, const std::vector<LineSettings>& lines)
    : request_(std::make_unique<Request>()) {
  const Chip chip = Open(chip_name);
  request_->chip_name = chip_name;
  std::vector<Wish> wishes;
  std::string names;
  for (const LineSettings& line : lines) {
    wishes.push_back({line.line, FindOffset(chip, chip_name, line.line), MakeSettings(line)});
    request_->offsets.push_back(wishes.back().offset);
    gpiod_line_settings* settings = wishes.back().settings.get();
    gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_edge_detection(settings, GPIOD_LINE_EDGE_BOTH);
    if (!names.empty()) names += ", ";
    names += line.line;
  }
  request_->lines =
      RequestLines(chip, chip_name, wishes,
                   (lines.size() == 1 ? "request input line " : "request input lines ") + names);
  request_->edges.reset(gpiod_edge_event_buffer_new(kEdgesAtOnce));
  if (!request_->edges) throw std::bad_alloc();
}

InputLines::~InputLines() = default;

std::vector<bool> InputLines::Levels() const {
  std::vector<gpiod_line_value> values(request_->offsets.size());
  if (gpiod_line_request_get_values_subset(request_->lines.get(), values.size(),
                                           request_->offsets.data(), values.data()) != 0)
    throw GpioError(request_->chip_name, "read input lines", errno);
  std::vector<bool> levels;
  for (const gpiod_line_value value : values) levels.push_back(value == GPIOD_LINE_VALUE_ACTIVE);
  return levels;
}

std::vector<int> InputLines::edge_fds() const {
  return {gpiod_line_request_get_fd(request_->lines.get())};
}

void InputLines::DrainEdges() {
  for (;;) {
    const int ready = gpiod_line_request_wait_edge_events(request_->lines.get(), 0);
    if (ready == 0) return;
    if (ready < 0 || gpiod_line_request_read_edge_events(request_->lines.get(),
                                                         request_->edges.get(), kEdgesAtOnce) < 0)
      throw GpioError(request_->chip_name, "read edges", errno);
  }
}

struct OutputLine::Request {
  std::string chip_name;
  LineRequest line;
  unsigned offset = 0;
};

OutputLine::OutputLine(const std::string& chip_name, const LineSettings& line, bool active)
    : request_(std::make_unique<Request>()) {
  const Chip chip = Open(chip_name);
  request_->chip_name = chip_name;
  request_->offset = FindOffset(chip, chip_name, line.line);
  std::vector<Wish> wish;
  wish.push_back({line.line, request_->offset, MakeSettings(line)});
  gpiod_line_settings* settings = wish[0].settings.get();
  gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT);
  gpiod_line_settings_set_output_value(
      settings, active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
  request_->line = RequestLines(chip, chip_name, wish, "request output line " + line.line);
}

OutputLine::~OutputLine() = default;

void OutputLine::Set(bool active) {
  if (gpiod_line_request_set_value(request_->line.get(), request_->offset,
                                   active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) !=
      0)
    throw GpioError(request_->chip_name, "set output line", errno);
}

bool OutputLine::Get() const {
  const gpiod_line_value value =
      gpiod_line_request_get_value(request_->line.get(), request_->offset);
  if (value == GPIOD_LINE_VALUE_ERROR)
    throw GpioError(request_->chip_name, "read back output line", errno);
  return value == GPIOD_LINE_VALUE_ACTIVE;
}

}  // namespace luxfield::hal::gpiod

#endif
