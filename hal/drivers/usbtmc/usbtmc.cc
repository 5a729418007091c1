#include "luxfield/hal/drivers/usbtmc/usbtmc.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "luxfield/hal/drivers/usbtmc/message.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/permission.h"

namespace luxfield::hal::usbtmc {
namespace {

constexpr std::uint8_t kClass = 0xfe, kSubclass = 3;
constexpr std::uint8_t kInitiateAbortOut = 1, kCheckAbortOut = 2, kInitiateAbortIn = 3,
                       kCheckAbortIn = 4, kInitiateClear = 5, kCheckClear = 6, kCapabilities = 7;
// bmRequestType: class requests that read, to an endpoint and to an interface.
constexpr std::uint8_t kToEndpoint = 0xa2, kToInterface = 0xa1;
constexpr std::uint8_t kSuccess = 1, kPending = 2;
constexpr unsigned kControl_ms = 100;
constexpr int kMostChecks = 5;               // of an abort or clear that is pending
constexpr std::uint32_t kMostReply = 65536;  // bytes asked for at once
constexpr std::size_t kMostMessage = 1 << 20;

struct ContextDeleter {
  void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct HandleDeleter {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
using Context = std::unique_ptr<libusb_context, ContextDeleter>;
using Handle = std::unique_ptr<libusb_device_handle, HandleDeleter>;

std::string NameOf(std::uint16_t vendor, std::uint16_t product) {
  return fmt::format("{:04x}:{:04x}", vendor, product);
}

HardwareError UsbError(const std::string& device, const std::string& operation, int error) {
  const auto make = [&](Fault fault, const char* remedy) {
    return HardwareError(fault, device, operation,
                         libusb_strerror(static_cast<libusb_error>(error)), remedy);
  };
  switch (error) {
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
    case LIBUSB_ERROR_IO:
      return make(Fault::kDisconnected, "check power and cable, then resume");
    case LIBUSB_ERROR_TIMEOUT:
      return make(Fault::kTimeout, "check that the instrument is not waiting for a trigger");
    case LIBUSB_ERROR_INTERRUPTED:
      return HardwareError(Fault::kStopped, device, operation,
                           "gave way to an order that could not wait",
                           "find out what was switched off, and why");
    case LIBUSB_ERROR_ACCESS:
      return make(Fault::kRefused, kJoinPlugdev);
    case LIBUSB_ERROR_BUSY:
      return make(Fault::kRefused, "end the program that uses the instrument");
    default:
      return make(Fault::kProtocol, "switch the instrument off and on");
  }
}

// The endpoints of a USBTMC interface.
struct Endpoints {
  int interface = 0;
  std::uint8_t out = 0, in = 0;
  std::size_t packet = 512;  // largest, of `in`
};

std::optional<Endpoints> FindInterface(libusb_device* device) {
  libusb_config_descriptor* raw = nullptr;
  if (libusb_get_active_config_descriptor(device, &raw) != 0 &&
      libusb_get_config_descriptor(device, 0, &raw) != 0)
    return {};
  const std::unique_ptr<libusb_config_descriptor, decltype(&libusb_free_config_descriptor)> config(
      raw, libusb_free_config_descriptor);
  for (int k = 0; k < config->bNumInterfaces; ++k) {
    if (config->interface[k].num_altsetting < 1) continue;
    const libusb_interface_descriptor& interface = config->interface[k].altsetting[0];
    if (interface.bInterfaceClass != kClass || interface.bInterfaceSubClass != kSubclass) continue;
    Endpoints found;
    found.interface = interface.bInterfaceNumber;
    for (int e = 0; e < interface.bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& endpoint = interface.endpoint[e];
      if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK)
        continue;
      if (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) {
        found.in = endpoint.bEndpointAddress;
        found.packet = std::max<std::size_t>(endpoint.wMaxPacketSize, 1);
      } else {
        found.out = endpoint.bEndpointAddress;
      }
    }
    if (found.in && found.out) return found;
  }
  return {};
}

Context MakeContext() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context)) throw UsbError("USB", "start", error);
  return Context(context);
}

std::string SerialOf(libusb_device_handle* handle, const libusb_device_descriptor& descriptor) {
  std::array<unsigned char, 256> text{};
  if (!descriptor.iSerialNumber) return {};
  const int length = libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber,
                                                        text.data(), text.size());
  return length > 0 ? std::string(text.begin(), text.begin() + length) : std::string();
}

// Calls visit(device, descriptor, endpoints) for every USBTMC interface.
template <typename Visit>
void ForEachInstrument(libusb_context* context, Visit&& visit) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  if (count < 0) throw UsbError("USB", "list devices", static_cast<int>(count));
  struct ListGuard {
    libusb_device** list;
    ~ListGuard() { libusb_free_device_list(list, 1); }
  } guard{list};
  for (ssize_t k = 0; k < count; ++k) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(list[k], &descriptor) != 0) continue;
    if (const auto endpoints = FindInterface(list[k])) visit(list[k], descriptor, *endpoints);
  }
}

unsigned MillisecondsTo(SteadyTime deadline) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  // libusb waits for ever at 0.
  return static_cast<unsigned>(std::clamp<std::int64_t>(left.count(), 1, 1'000'000'000));
}

}  // namespace

struct UsbTmc::Usb {
  Context context;
  Handle handle;
  Endpoints endpoints;

  ~Usb() {
    if (handle) libusb_release_interface(handle.get(), endpoints.interface);
  }
  // A class request's answer; its first byte is a status.
  template <std::size_t size>
  int Control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
              std::array<std::uint8_t, size>* answer) const {
    return libusb_control_transfer(handle.get(), type, request, value, index, answer->data(),
                                   static_cast<std::uint16_t>(size), kControl_ms);
  }
};

// That some state RL1 (remote and local control) and do not have it is no matter here: it is never
// asked for.
Quirks FindQuirks(std::uint16_t vendor, std::uint16_t product) {
  struct Row {
    std::uint16_t vendor, product;
    Quirks quirks;
  };
  constexpr std::uint16_t kRigol = 0x1ab1;
  static constexpr std::array kRows = {
      // DS1000Z, MSO1000Z: python-ivi/python-usbtmc, pull request 18.
      Row{kRigol, 0x04ce, {.one_header = true}},
      // DS1000 and DS2000: Linux 4.9, drivers/usb/class/usbtmc.c, usbtmc_id_quirk.
      Row{kRigol, 0x0588, {.one_header = true}},
      Row{kRigol, 0x04b0, {.one_header = true}},
      // DHO800, DHO900: sigrokproject/libsigrok, pull request 246.
      Row{kRigol, 0x044d, {.any_tag = true}},
  };
  Quirks quirks;
  for (const Row& row : kRows)
    if (row.vendor == vendor && row.product == product) quirks = row.quirks;
  // Seen of the DS1000Z (python-usbtmc, pull request 62), expected of the maker's others: what is
  // not cleared at worst holds a reply that another program has left.
  if (vendor == kRigol) quirks.no_clear = true;
  return quirks;
}

std::string QuirkNames(const Quirks& quirks) {
  std::vector<std::string_view> names;
  if (quirks.no_clear) names.emplace_back("no_clear");
  if (quirks.any_tag) names.emplace_back("any_tag");
  if (quirks.one_header) names.emplace_back("one_header");
  return fmt::format("{}", fmt::join(names, ", "));
}

std::vector<UsbTmcDevice> ListUsbTmcDevices() {
  const Context context = MakeContext();
  std::vector<UsbTmcDevice> devices;
  ForEachInstrument(
      context.get(),
      [&](libusb_device* device, const libusb_device_descriptor& descriptor, const Endpoints&) {
        UsbTmcDevice found{descriptor.idVendor, descriptor.idProduct, {}, {}};
        libusb_device_handle* raw = nullptr;
        if (const int error = libusb_open(device, &raw)) {
          found.problem =
              UsbError(NameOf(descriptor.idVendor, descriptor.idProduct), "open", error).what();
        } else {
          const Handle handle(raw);
          found.serial = SerialOf(handle.get(), descriptor);
        }
        devices.push_back(std::move(found));
      });
  return devices;
}

UsbTmc::UsbTmc(const UsbTmcOptions& options)
    : name_(NameOf(options.vendor, options.product) +
            (options.serial.empty() ? "" : " " + options.serial)),
      quirks_(options.quirks),
      usb_(std::make_unique<Usb>()) {
  usb_->context = MakeContext();
  int found = 0, error = 0;
  ForEachInstrument(
      usb_->context.get(), [&](libusb_device* device, const libusb_device_descriptor& descriptor,
                               const Endpoints& endpoints) {
        if (descriptor.idVendor != options.vendor || descriptor.idProduct != options.product)
          return;
        libusb_device_handle* raw = nullptr;
        if (const int failed = libusb_open(device, &raw)) {
          error = failed;
          return;
        }
        Handle handle(raw);
        if (!options.serial.empty() && SerialOf(handle.get(), descriptor) != options.serial) return;
        ++found;
        usb_->handle = std::move(handle);
        usb_->endpoints = endpoints;
      });
  if (found > 1) {
    usb_->handle.reset();
    throw HardwareError(Fault::kRefused, name_, "open",
                        fmt::format("{} instruments have these numbers", found),
                        "give the serial number in lab.toml");
  }
  if (found == 0) throw UsbError(name_, "open", error ? error : int{LIBUSB_ERROR_NO_DEVICE});
  libusb_set_auto_detach_kernel_driver(usb_->handle.get(), 1);
  if (const int claimed = libusb_claim_interface(usb_->handle.get(), usb_->endpoints.interface)) {
    usb_->handle.reset();
    throw UsbError(name_, "open", claimed);
  }
  std::array<std::uint8_t, 24> capabilities{};
  const int got =
      usb_->Control(kToInterface, kCapabilities, 0,
                    static_cast<std::uint16_t>(usb_->endpoints.interface), &capabilities);
  if (got < 0) throw UsbError(name_, "read capabilities", got);
  if (got < 1 || capabilities[0] != kSuccess)
    throw HardwareError(Fault::kProtocol, name_, "read capabilities",
                        fmt::format("status {} in {} bytes", capabilities[0], got),
                        "switch the instrument off and on");
  if (!quirks_.no_clear) Clear();
}

UsbTmc::~UsbTmc() = default;

void UsbTmc::Clear() {
  const auto interface = static_cast<std::uint16_t>(usb_->endpoints.interface);
  std::array<std::uint8_t, 1> begun{};
  const int got = usb_->Control(kToInterface, kInitiateClear, 0, interface, &begun);
  if (got < 0) throw UsbError(name_, "clear", got);
  for (int check = 0; check < kMostChecks; ++check) {
    std::array<std::uint8_t, 2> status{};
    const int checked = usb_->Control(kToInterface, kCheckClear, 0, interface, &status);
    if (checked < 0) throw UsbError(name_, "clear", checked);
    if (status[0] != kPending) break;
    if (status[1] & 1) DrainIn();
  }
  libusb_clear_halt(usb_->handle.get(), usb_->endpoints.out);
}

void UsbTmc::AbortOut() {
  std::array<std::uint8_t, 2> begun{};
  if (usb_->Control(kToEndpoint, kInitiateAbortOut, tag_, usb_->endpoints.out, &begun) >= 1 &&
      begun[0] == kSuccess)
    for (int check = 0; check < kMostChecks; ++check) {
      std::array<std::uint8_t, 8> status{};
      if (usb_->Control(kToEndpoint, kCheckAbortOut, 0, usb_->endpoints.out, &status) < 1 ||
          status[0] != kPending)
        break;
    }
  libusb_clear_halt(usb_->handle.get(), usb_->endpoints.out);
}

// Reads and forgets up to the next short packet.
void UsbTmc::DrainIn() const {
  std::vector<std::uint8_t> buffer(usb_->endpoints.packet * 64);
  for (int transfer = 0; transfer < kMostChecks; ++transfer) {
    int got = 0;
    const int error = libusb_bulk_transfer(usb_->handle.get(), usb_->endpoints.in, buffer.data(),
                                           static_cast<int>(buffer.size()), &got, kControl_ms / 2);
    if (error || static_cast<std::size_t>(got) < buffer.size()) return;
  }
}

void UsbTmc::BeginAbortIn() {
  std::array<std::uint8_t, 2> begun{};
  usb_->Control(kToEndpoint, kInitiateAbortIn, tag_, usb_->endpoints.in, &begun);
  abort_in_ = begun[0] == kSuccess ? Abort::kBegun : Abort::kRefused;
}

void UsbTmc::EndAbortIn() {
  const Abort abort = std::exchange(abort_in_, Abort::kNone);
  if (abort == Abort::kNone) return;
  if (abort == Abort::kBegun) {
    DrainIn();
    for (int check = 0; check < kMostChecks; ++check) {
      std::array<std::uint8_t, 8> status{};
      if (usb_->Control(kToEndpoint, kCheckAbortIn, 0, usb_->endpoints.in, &status) < 1 ||
          status[0] != kPending)
        break;
      if (status[1] & 1) DrainIn();
    }
  }
  libusb_clear_halt(usb_->handle.get(), usb_->endpoints.in);
}

void UsbTmc::Write(std::string_view message, SteadyTime deadline) {
  tag_ = NextTag(tag_);
  Bytes bytes = EncodeMessage(tag_, message);
  int sent = 0;
  const int error =
      libusb_bulk_transfer(usb_->handle.get(), usb_->endpoints.out, bytes.data(),
                           static_cast<int>(bytes.size()), &sent, MillisecondsTo(deadline));
  if (!error && static_cast<std::size_t>(sent) == bytes.size()) return;
  if (error != LIBUSB_ERROR_NO_DEVICE) AbortOut();
  throw UsbError(name_, "write", error ? error : int{LIBUSB_ERROR_IO});
}

void UsbTmc::GiveWay(bool give_way) {
  give_way_ = give_way;
  if (give_way) libusb_interrupt_event_handler(usb_->context.get());
}

// libusb's own call that waits cannot be ended from another thread.
int UsbTmc::BulkIn(std::vector<std::uint8_t>& bytes, int* moved, SteadyTime deadline) const {
  struct TransferDeleter {
    void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
  };
  const std::unique_ptr<libusb_transfer, TransferDeleter> transfer(libusb_alloc_transfer(0));
  if (!transfer) return LIBUSB_ERROR_NO_MEM;
  int completed = 0;
  libusb_fill_bulk_transfer(
      transfer.get(), usb_->handle.get(), usb_->endpoints.in, bytes.data(),
      static_cast<int>(bytes.size()),
      [](libusb_transfer* done) { *static_cast<int*>(done->user_data) = 1; }, &completed,
      MillisecondsTo(deadline));
  if (const int error = libusb_submit_transfer(transfer.get())) return error;
  bool cancelled = false;
  while (!completed) {
    if (!cancelled && give_way_) {
      libusb_cancel_transfer(transfer.get());
      cancelled = true;
    }
    const int error = libusb_handle_events_completed(usb_->context.get(), &completed);
    if (error && error != LIBUSB_ERROR_INTERRUPTED && !cancelled) {
      libusb_cancel_transfer(transfer.get());
      cancelled = true;
    }
  }
  *moved = transfer->actual_length;
  switch (transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return 0;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return LIBUSB_ERROR_TIMEOUT;
    case LIBUSB_TRANSFER_CANCELLED:
      return give_way_ ? LIBUSB_ERROR_INTERRUPTED : LIBUSB_ERROR_IO;
    case LIBUSB_TRANSFER_STALL:
      return LIBUSB_ERROR_PIPE;
    case LIBUSB_TRANSFER_OVERFLOW:
      return LIBUSB_ERROR_OVERFLOW;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return LIBUSB_ERROR_NO_DEVICE;
    default:
      return LIBUSB_ERROR_IO;
  }
}

void UsbTmc::Request(std::uint32_t max_size, SteadyTime deadline) {
  EndAbortIn();
  tag_ = NextTag(tag_);
  Bytes request = EncodeRequest(tag_, max_size);
  int moved = 0;
  if (const int error = libusb_bulk_transfer(usb_->handle.get(), usb_->endpoints.out,
                                             request.data(), static_cast<int>(request.size()),
                                             &moved, MillisecondsTo(deadline))) {
    if (error != LIBUSB_ERROR_NO_DEVICE) AbortOut();
    throw UsbError(name_, "ask for the reply", error);
  }
}

// One transfer.
std::vector<std::uint8_t> UsbTmc::Receive(std::size_t max_size, SteadyTime deadline) {
  // Whole packets, so that a device that sends more than it was asked for cannot overflow.
  const std::size_t packet = usb_->endpoints.packet,
                    room = (kHeaderBytes + max_size + 3 + packet) / packet * packet;
  std::vector<std::uint8_t> reply(room);
  int moved = 0;
  const int error = BulkIn(reply, &moved, deadline);
  if (error) {
    if (error != LIBUSB_ERROR_NO_DEVICE) BeginAbortIn();
    // What could not wait does not wait for the rest either, which concerns replies alone.
    if (error != LIBUSB_ERROR_INTERRUPTED) EndAbortIn();
    throw UsbError(name_, "read the reply", error);
  }
  reply.resize(static_cast<std::size_t>(moved));
  return reply;
}

std::string UsbTmc::Read(SteadyTime deadline) {
  // Each transfer has 1 ms at least: an instrument that goes on sending pieces is past it all the
  // same.
  const auto require_time = [&] {
    if (std::chrono::steady_clock::now() < deadline) return;
    BeginAbortIn();
    EndAbortIn();
    throw UsbError(name_, "read the reply", LIBUSB_ERROR_TIMEOUT);
  };
  std::string message;
  for (;;) {
    Request(kMostReply, deadline);
    std::vector<std::uint8_t> reply = Receive(kMostReply, deadline);
    ReplyHeader header = ParseReply(reply, tag_, kMostReply, quirks_.any_tag);
    while (quirks_.one_header && header.problem.empty() &&
           reply.size() < kHeaderBytes + header.size) {
      require_time();
      const auto more = Receive(kHeaderBytes + header.size - reply.size(), deadline);
      if (more.empty()) break;
      reply.insert(reply.end(), more.begin(), more.end());
    }
    if (header.problem.empty() && reply.size() < kHeaderBytes + header.size)
      header.problem =
          fmt::format("{} of {} bytes of the reply came", reply.size() - kHeaderBytes, header.size);
    if (header.problem.empty() && message.size() + header.size > kMostMessage)
      header.problem = "the reply does not end";
    if (!header.problem.empty()) {
      BeginAbortIn();
      EndAbortIn();
      throw HardwareError(Fault::kProtocol, name_, "read the reply", header.problem,
                          "switch the instrument off and on");
    }
    message.append(reply.begin() + kHeaderBytes, reply.begin() + kHeaderBytes + header.size);
    if (header.end) break;
    require_time();
  }
  while (message.ends_with('\n') || message.ends_with('\r')) message.pop_back();
  return message;
}

}  // namespace luxfield::hal::usbtmc
