#include "tests/gpiod/fake_gpio_chip.h"

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <utility>

namespace luxfield::hal::gpiod {
namespace {

constexpr unsigned kQueue = 16;

void Check(GError* error) {
  if (!error) return;
  const std::string what = error->message;
  g_error_free(error);
  throw std::runtime_error("umockdev: " + what);
}

// Lets `change` work on the client's structure; it returns an errno.
template <typename T, typename Change>
gboolean Reply(UMockdevIoctlClient* client, Change&& change) {
  GError* error = nullptr;
  UMockdevIoctlData* data =
      umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(T), &error);
  if (!data) {
    g_clear_error(&error);
    umockdev_ioctl_client_complete(client, -1, EFAULT);
    return TRUE;
  }
  T value;
  std::memcpy(&value, data->data, sizeof value);
  const int failed = change(value);
  umockdev_ioctl_data_update(data, 0, reinterpret_cast<guint8*>(&value), sizeof value);
  g_object_unref(data);
  umockdev_ioctl_client_complete(client, failed ? -1 : 0, failed);
  return TRUE;
}

void CopyName(char (&to)[GPIO_MAX_NAME_SIZE], const std::string& from) {
  std::snprintf(to, sizeof to, "%s", from.c_str());
}

}  // namespace

FakeGpioChip::FakeGpioChip(std::vector<std::string> names)
    : FakeGpioChip(umockdev_testbed_new(), std::move(names), Users::kThisProcess) {
  g_object_unref(testbed_);  // the other constructor holds it too
}

FakeGpioChip::FakeGpioChip(UMockdevTestbed* testbed, std::vector<std::string> names, Users users)
    : names_(std::move(names)),
      testbed_(UMOCKDEV_TESTBED(g_object_ref(testbed))),
      users_(users),
      pins_(names_.size()),
      held_(names_.size()),
      stuck_(names_.size()),
      history_(names_.size()) {
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_,
                                   "P: /devices/gpiochip0\nN: gpiochip0\nE: "
                                   "DEVNAME=/dev/gpiochip0\nE: SUBSYSTEM=gpio\nA: dev=254:0\\n\n",
                                   &error);
  Check(error);
  UMockdevIoctlBase* handler = umockdev_ioctl_base_new();
  handlers_.push_back(handler);
  g_signal_connect(handler, "handle-ioctl", G_CALLBACK(OnChip), this);
  umockdev_testbed_attach_ioctl(testbed_, kPath, handler, &error);
  Check(error);
}

FakeGpioChip::~FakeGpioChip() {
  for (UMockdevIoctlBase* handler : handlers_) g_object_unref(handler);
  g_object_unref(testbed_);
}

unsigned FakeGpioChip::OffsetOf(const std::string& line) const {
  const auto found = std::find(names_.begin(), names_.end(), line);
  if (found == names_.end()) throw std::invalid_argument("no line " + line);
  return static_cast<unsigned>(found - names_.begin());
}

void FakeGpioChip::Couple(const std::string& output, const std::string& sensor) {
  const std::lock_guard lock(mutex_);
  coupled_[OffsetOf(output)] = OffsetOf(sensor);
}

void FakeGpioChip::OnOutput(std::function<void(const std::string&, bool)> action) {
  const std::lock_guard lock(mutex_);
  on_output_ = std::move(action);
}

void FakeGpioChip::SetPin(const std::string& line, bool high) {
  const std::lock_guard lock(mutex_);
  Drive(OffsetOf(line), high);
}

void FakeGpioChip::Drive(unsigned offset, bool high) {
  if (pins_[offset] == high) return;
  pins_[offset] = high;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const auto time_ns = static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u +
                       static_cast<std::uint64_t>(now.tv_nsec);
  for (Request& request : requests_) {
    if (request.fifo.empty()) continue;
    if (std::find(request.offsets.begin(), request.offsets.end(), offset) == request.offsets.end())
      continue;
    const bool rising = high != request.active_low;
    const int fd = open(request.fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) continue;
    int waiting = 0;
    ioctl(fd, FIONREAD, &waiting);
    if (request.version2) {
      gpio_v2_line_event event{};
      event.timestamp_ns = time_ns;
      event.id = rising ? GPIO_V2_LINE_EVENT_RISING_EDGE : GPIO_V2_LINE_EVENT_FALLING_EDGE;
      event.offset = offset;
      if (static_cast<unsigned>(waiting) < kQueue * sizeof event &&
          write(fd, &event, sizeof event) != sizeof event)
        std::perror("fake edge");
    } else {
      gpioevent_data event{};
      event.timestamp = time_ns;
      event.id = rising ? GPIOEVENT_EVENT_RISING_EDGE : GPIOEVENT_EVENT_FALLING_EDGE;
      if (static_cast<unsigned>(waiting) < kQueue * sizeof event &&
          write(fd, &event, sizeof event) != sizeof event)
        std::perror("fake edge");
    }
    close(fd);
  }
}

bool FakeGpioChip::Pin(const std::string& line) {
  const std::lock_guard lock(mutex_);
  return pins_[OffsetOf(line)];
}

bool FakeGpioChip::AwaitPin(const std::string& line, bool high) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::seconds(10),
                           [&] { return pins_[OffsetOf(line)] == high; });
}

std::vector<bool> FakeGpioChip::History(const std::string& line) {
  const std::lock_guard lock(mutex_);
  return history_[OffsetOf(line)];
}

void FakeGpioChip::HoldElsewhere(const std::string& line) {
  const std::lock_guard lock(mutex_);
  held_[OffsetOf(line)] = true;
}

void FakeGpioChip::StickPin(const std::string& line) {
  const std::lock_guard lock(mutex_);
  stuck_[OffsetOf(line)] = true;
}

void FakeGpioChip::FailReads(int error) {
  const std::lock_guard lock(mutex_);
  read_error_ = error;
}

void FakeGpioChip::WriteOutput(unsigned offset, bool high) {
  history_[offset].push_back(high);
  if (!stuck_[offset]) pins_[offset] = high;
  if (const auto coupled = coupled_.find(offset); coupled != coupled_.end())
    Drive(coupled->second, high);
  if (on_output_) on_output_(names_[offset], high);
  changed_.notify_all();
}

int FakeGpioChip::CheckFree(unsigned offset) const {
  if (offset >= names_.size()) return EINVAL;
  return held_[offset] ? EBUSY : 0;
}

// A node for a request's descriptor. Edges come through a FIFO, so that poll tells the truth.
int FakeGpioChip::Open(Request request, bool edges) {
  const std::size_t number = requests_.size();
  const std::string node = "gpioline" + std::to_string(number), device = "/dev/" + node;
  const std::string record = "P: /devices/" + node + "\nN: " + node + "\nE: DEVNAME=" + device +
                             "\nE: SUBSYSTEM=misc\nA: dev=10:" + std::to_string(100 + number) +
                             "\\n\n";
  GError* error = nullptr;
  umockdev_testbed_add_from_string(testbed_, record.c_str(), &error);
  Check(error);
  if (edges) {
    gchar* root = umockdev_testbed_get_root_dir(testbed_);
    request.fifo = root + device;
    g_free(root);
    unlink(request.fifo.c_str());
    if (mkfifo(request.fifo.c_str(), 0600) != 0) return -1;
  }
  UMockdevIoctlBase* handler = umockdev_ioctl_base_new();
  handlers_.push_back(handler);
  request_of_[handler] = number;
  requests_.push_back(std::move(request));
  g_signal_connect(handler, "handle-ioctl", G_CALLBACK(OnRequest), this);
  umockdev_testbed_attach_ioctl(testbed_, device.c_str(), handler, &error);
  Check(error);
  return users_ == Users::kOtherProcesses ? -2 - static_cast<int>(number)
                                          : open(device.c_str(), O_RDWR | O_CLOEXEC);
}

gboolean FakeGpioChip::OnChip(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
  return static_cast<FakeGpioChip*>(self)->AnswerChip(client);
}

gboolean FakeGpioChip::OnRequest(UMockdevIoctlBase* handler, UMockdevIoctlClient* client,
                                 gpointer self) {
  auto* chip = static_cast<FakeGpioChip*>(self);
  const std::lock_guard lock(chip->mutex_);
  return chip->AnswerRequest(client, chip->requests_[chip->request_of_.at(handler)]);
}

gboolean FakeGpioChip::AnswerChip(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  switch (umockdev_ioctl_client_get_request(client)) {
    case GPIO_GET_CHIPINFO_IOCTL:
      return Reply<gpiochip_info>(client, [&](gpiochip_info& info) {
        CopyName(info.name, "gpiochip0");
        CopyName(info.label, "fake");
        info.lines = static_cast<__u32>(names_.size());
        return 0;
      });
    case GPIO_GET_LINEINFO_IOCTL:
      return Reply<gpioline_info>(client, [&](gpioline_info& info) {
        if (info.line_offset >= names_.size()) return EINVAL;
        CopyName(info.name, names_[info.line_offset]);
        if (!held_[info.line_offset]) return 0;
        info.flags = GPIOLINE_FLAG_KERNEL;
        CopyName(info.consumer, "gpiomon");
        return 0;
      });
    case GPIO_V2_GET_LINEINFO_IOCTL:
      return Reply<gpio_v2_line_info>(client, [&](gpio_v2_line_info& info) {
        if (info.offset >= names_.size()) return EINVAL;
        CopyName(info.name, names_[info.offset]);
        info.flags = GPIO_V2_LINE_FLAG_INPUT;
        if (!held_[info.offset]) return 0;
        info.flags |= GPIO_V2_LINE_FLAG_USED;
        CopyName(info.consumer, "gpiomon");
        return 0;
      });
    case GPIO_GET_LINEHANDLE_IOCTL:
      return Reply<gpiohandle_request>(client, [&](gpiohandle_request& r) {
        Request request;
        request.offsets.assign(r.lineoffsets, r.lineoffsets + r.lines);
        request.active_low = r.flags & GPIOHANDLE_REQUEST_ACTIVE_LOW;
        for (const unsigned offset : request.offsets)
          if (const int error = CheckFree(offset)) return error;
        if (r.flags & GPIOHANDLE_REQUEST_OUTPUT)
          for (std::size_t k = 0; k < request.offsets.size(); ++k)
            WriteOutput(request.offsets[k], (r.default_values[k] != 0) != request.active_low);
        r.fd = Open(std::move(request), false);
        return r.fd == -1 ? errno : 0;
      });
    case GPIO_GET_LINEEVENT_IOCTL:
      return Reply<gpioevent_request>(client, [&](gpioevent_request& r) {
        if (const int error = CheckFree(r.lineoffset)) return error;
        Request request;
        request.offsets = {r.lineoffset};
        request.active_low = r.handleflags & GPIOHANDLE_REQUEST_ACTIVE_LOW;
        r.fd = Open(std::move(request), true);
        return r.fd == -1 ? errno : 0;
      });
    case GPIO_V2_GET_LINE_IOCTL:
      return Reply<gpio_v2_line_request>(client, [&](gpio_v2_line_request& r) {
        Request request;
        request.version2 = true;
        request.offsets.assign(r.offsets, r.offsets + r.num_lines);
        // All lines of a request have the same settings in our programs, values aside.
        __u64 flags = r.config.flags, values = 0;
        for (unsigned k = 0; k < r.config.num_attrs; ++k) {
          const auto& attribute = r.config.attrs[k].attr;
          if (attribute.id == GPIO_V2_LINE_ATTR_ID_FLAGS) flags = attribute.flags;
          if (attribute.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES) values = attribute.values;
        }
        request.active_low = flags & GPIO_V2_LINE_FLAG_ACTIVE_LOW;
        for (const unsigned offset : request.offsets)
          if (const int error = CheckFree(offset)) return error;
        if (flags & GPIO_V2_LINE_FLAG_OUTPUT)
          for (std::size_t k = 0; k < request.offsets.size(); ++k)
            WriteOutput(request.offsets[k], ((values >> k & 1) != 0) != request.active_low);
        r.fd = Open(std::move(request), (flags & GPIO_V2_LINE_FLAG_INPUT) != 0);
        return r.fd == -1 ? errno : 0;
      });
    default:
      return FALSE;
  }
}

gboolean FakeGpioChip::AnswerRequest(UMockdevIoctlClient* client, Request& request) {
  const auto active = [&](std::size_t k) {
    return pins_[request.offsets[k]] != request.active_low;
  };
  switch (umockdev_ioctl_client_get_request(client)) {
    case GPIOHANDLE_GET_LINE_VALUES_IOCTL:
      return Reply<gpiohandle_data>(client, [&](gpiohandle_data& data) {
        for (std::size_t k = 0; k < request.offsets.size(); ++k) data.values[k] = active(k);
        return ReadError();
      });
    case GPIOHANDLE_SET_LINE_VALUES_IOCTL:
      return Reply<gpiohandle_data>(client, [&](gpiohandle_data& data) {
        for (std::size_t k = 0; k < request.offsets.size(); ++k)
          WriteOutput(request.offsets[k], (data.values[k] != 0) != request.active_low);
        return 0;
      });
    case GPIO_V2_LINE_GET_VALUES_IOCTL:
      return Reply<gpio_v2_line_values>(client, [&](gpio_v2_line_values& values) {
        values.bits = 0;
        for (std::size_t k = 0; k < request.offsets.size(); ++k)
          values.bits |= __u64{active(k)} << k;
        return ReadError();
      });
    case GPIO_V2_LINE_SET_VALUES_IOCTL:
      return Reply<gpio_v2_line_values>(client, [&](gpio_v2_line_values& values) {
        for (std::size_t k = 0; k < request.offsets.size(); ++k)
          if (values.mask >> k & 1)
            WriteOutput(request.offsets[k], ((values.bits >> k & 1) != 0) != request.active_low);
        return 0;
      });
    default:
      return FALSE;
  }
}

}  // namespace luxfield::hal::gpiod
