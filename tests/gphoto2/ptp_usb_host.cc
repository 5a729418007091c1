#include "tests/gphoto2/ptp_usb_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

namespace luxfield::hal::gphoto2 {
namespace {

// One still image interface: bulk in and out of 512 bytes, interrupt in.
const usb::Bytes kInterface = {9, 4, 0,    0, 3,    6,    1, 1, 0,  //
                               7, 5, 0x81, 2, 0x00, 0x02, 0,        //
                               7, 5, 0x02, 2, 0x00, 0x02, 0,        //
                               7, 5, 0x83, 3, 64,   0x00, 8};
constexpr int kEvents = 0x83;
constexpr std::size_t kHead = 12, kPacket = 512;
enum Kind { kCommand = 1, kData = 2, kResponse = 3, kEvent = 4 };

std::uint32_t NumberAt(const std::uint8_t* bytes, int size) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes, static_cast<std::size_t>(size));
  return value;
}

std::string Container(Kind kind, std::uint16_t code, std::uint32_t transaction,
                      const std::string& payload) {
  std::string bytes;
  const auto append = [&bytes](std::uint64_t value, int size) {
    for (int k = 0; k < size; ++k) bytes += static_cast<char>(value >> 8 * k);
  };
  append(kHead + payload.size(), 4);
  append(kind, 2);
  append(code, 2);
  append(transaction, 4);
  return bytes + payload;
}

// String descriptors: the languages, then maker, product and serial number.
std::optional<usb::Bytes> Describe(const std::uint8_t* request) {
  if (request[0] != 0x80 || request[1] != 6 || request[3] != 3) return std::nullopt;
  constexpr const char* kTexts[] = {"", "Luxfield", "Fake PTP", "LUX7"};
  if (request[2] == 0) return usb::Bytes{4, 3, 9, 4};
  const std::string text = kTexts[request[2] & 3];
  usb::Bytes answer = {static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) answer.insert(answer.end(), {static_cast<std::uint8_t>(c), 0});
  return answer;
}

}  // namespace

PtpUsbHost::PtpUsbHost(UMockdevTestbed* testbed, int product, fakes::PtpCamera& camera)
    : camera_(camera),
      port_(fmt::format("usb:001,{:03}", product + 1)),
      usb_(testbed, product, kInterface,
           {.control = Describe,
            .out = [this](int, const std::uint8_t* bytes,
                          std::size_t size) { return Out(bytes, size); },
            .in = [this](int endpoint, std::size_t room) { return In(endpoint, room); }}),
      events_thread_([this] { QueueEvents(); }) {}

PtpUsbHost::~PtpUsbHost() {
  ending_ = true;
  camera_.Wake();
  events_thread_.join();
}

bool PtpUsbHost::Out(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::uint16_t kSetDevicePropValue = 0x1016;  // the one that sends data
  if (data_.empty() && size >= kHead && NumberAt(bytes + 4, 2) == kCommand) {
    operation_ = {};
    operation_.code = static_cast<std::uint16_t>(NumberAt(bytes + 6, 2));
    operation_.transaction = NumberAt(bytes + 8, 4);
    for (std::size_t k = 0; k < operation_.parameters.size() && kHead + 4 * (k + 1) <= size; ++k)
      operation_.parameters[k] = NumberAt(bytes + kHead + 4 * k, 4);
    replies_.clear();  // of an operation that its program gave up
    if (operation_.code != kSetDevicePropValue) Execute();
    return true;
  }
  data_.append(reinterpret_cast<const char*>(bytes), size);
  if (data_.size() >= kHead &&
      data_.size() >= NumberAt(reinterpret_cast<const std::uint8_t*>(data_.data()), 4)) {
    operation_.data = data_.substr(kHead);
    data_.clear();
    Execute();
  }
  return true;
}

void PtpUsbHost::Execute() {
  const fakes::PtpReply reply = camera_.Execute(operation_);
  if (reply.data) {
    replies_.push_back(Container(kData, operation_.code, operation_.transaction, *reply.data));
    // An empty packet ends what fills its last one.
    if (replies_.back().size() % kPacket == 0) replies_.emplace_back();
  }
  replies_.push_back(Container(kResponse, reply.code, operation_.transaction, {}));
}

std::optional<usb::Bytes> PtpUsbHost::In(int endpoint, std::size_t room) {
  std::deque<std::string>& queue = endpoint == kEvents ? events_ : replies_;
  if (queue.empty()) return std::nullopt;
  std::string& first = queue.front();
  const std::size_t size = std::min(room, first.size());
  usb::Bytes bytes(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(size));
  first.erase(0, size);
  if (first.empty()) queue.pop_front();
  return bytes;
}

void PtpUsbHost::QueueEvents() {
  while (!ending_) {
    const auto event =
        camera_.WaitEvent(std::chrono::steady_clock::now() + std::chrono::seconds(1));
    if (!event) continue;
    std::string payload;
    for (int k = 0; k < 4; ++k) payload += static_cast<char>(event->parameter >> 8 * k);
    const auto lock = usb_.Lock();
    events_.push_back(Container(kEvent, event->code, 0, payload));
    usb_.Serve();
  }
}

}  // namespace luxfield::hal::gphoto2
