#include "tests/fakes/ptp_ip_host.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace luxfield::fakes {
namespace {

enum Kind : std::uint32_t {
  kInitCommand = 1,
  kInitCommandAck = 2,
  kInitEvent = 3,
  kInitEventAck = 4,
  kOperation = 6,
  kResponse = 7,
  kEvent = 8,
  kStartData = 9,
  kData = 10,
  kEndData = 12,
};

struct Packet {
  std::uint32_t kind = 0;
  std::string body;
};

void Append(std::string& bytes, std::uint64_t value, int size) {
  for (int k = 0; k < size; ++k) bytes += static_cast<char>(value >> 8 * k);
}

std::uint32_t NumberAt(std::string_view bytes, std::size_t at, std::size_t size = 4) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < size && at + k < bytes.size(); ++k)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + k])) << 8 * k;
  return value;
}

bool ReceiveAll(int socket, char* to, std::size_t size) {
  while (size > 0) {
    const ssize_t got = recv(socket, to, size, 0);
    if (got <= 0) return false;
    to += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

std::optional<Packet> Receive(int socket) {
  std::string head(8, '\0');
  if (!ReceiveAll(socket, head.data(), head.size())) return std::nullopt;
  const std::uint32_t size = NumberAt(head, 0);
  if (size < 8 || size > 1u << 24) return std::nullopt;
  Packet packet{NumberAt(head, 4), std::string(size - 8, '\0')};
  if (!ReceiveAll(socket, packet.body.data(), packet.body.size())) return std::nullopt;
  return packet;
}

// The operation that a packet begins, with the data that may follow it.
std::optional<PtpOperation> ReceiveOperation(int socket, const Packet& first) {
  PtpOperation operation;
  const bool data_follows = NumberAt(first.body, 0) == 2;
  operation.code = static_cast<std::uint16_t>(NumberAt(first.body, 4, 2));
  operation.transaction = NumberAt(first.body, 6);
  for (std::size_t k = 0; k < operation.parameters.size(); ++k)
    operation.parameters[k] = NumberAt(first.body, 10 + 4 * k);
  while (data_follows) {
    const auto packet = Receive(socket);
    if (!packet) return std::nullopt;
    if (packet->kind == kData || packet->kind == kEndData) operation.data += packet->body.substr(4);
    if (packet->kind == kEndData) break;
  }
  return operation;
}

}  // namespace

PtpIpHost::PtpIpHost(PtpCamera& camera) : camera_(camera) {
  listener_ = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (listener_ < 0 || bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      listen(listener_, 4) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no port on 127.0.0.1");
  port_ = fmt::format("ptpip:127.0.0.1:{0}:{0}", ntohs(address.sin_port));
  thread_ = std::thread([this] { Run(); });
}

PtpIpHost::~PtpIpHost() {
  ending_ = true;
  shutdown(listener_, SHUT_RDWR);
  Drop();
  thread_.join();
  close(listener_);
}

void PtpIpHost::Drop() {
  if (const int socket = commands_; socket >= 0) shutdown(socket, SHUT_RDWR);
}

// An initiator opens a connection for its commands, then one for events.
void PtpIpHost::Run() {
  int commands = -1;
  while (!ending_) {
    // An accept that waits holds the lowest free descriptor, which may be one that the program
    // under test has just lost and wants back.
    pollfd waiting{listener_, POLLIN, 0};
    if (poll(&waiting, 1, -1) < 0) continue;
    const int socket = accept(listener_, nullptr, nullptr);
    if (socket < 0) continue;
    const int at_once = 1;  // a reply's packets do not wait for one another's acknowledgement
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
    const auto hello = Receive(socket);
    if (hello && hello->kind == kInitCommand) {
      if (commands >= 0) close(commands);
      commands = socket;
      Acknowledge(commands);
      continue;
    }
    if (hello && hello->kind == kInitEvent && commands >= 0) {
      Send(socket, kInitEventAck, {});
      Serve(commands, socket);
      close(std::exchange(commands, -1));
    }
    close(socket);
  }
  if (commands >= 0) close(commands);
}

void PtpIpHost::Acknowledge(int commands) {
  std::string ack;
  Append(ack, 1, 4);               // number of the connection
  ack += std::string(16, '\x2a');  // the camera's GUID
  for (const char c : std::string_view("Fake PTP\0", 9))
    Append(ack, static_cast<unsigned char>(c), 2);
  Append(ack, 0x00010000, 4);
  Send(commands, kInitCommandAck, ack);
}

void PtpIpHost::SetDamage(Damage damage) {
  const std::lock_guard lock(damage_mutex_);
  damage_ = std::move(damage);
}

bool PtpIpHost::Send(int socket, std::uint32_t kind, const std::string& body) {
  std::string bytes;
  Append(bytes, body.size() + 8, 4);
  Append(bytes, kind, 4);
  bytes += body;
  {
    const std::lock_guard lock(damage_mutex_);
    if (damage_) damage_(bytes);
  }
  if (bytes.empty()) {
    const linger reset{1, 0};  // sent when the socket is closed
    setsockopt(socket, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    return false;
  }
  const char* from = bytes.data();
  std::size_t left = bytes.size();
  while (left > 0) {
    const ssize_t sent = send(socket, from, left, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    from += sent;
    left -= static_cast<std::size_t>(sent);
  }
  return true;
}

bool PtpIpHost::SendReply(int socket, std::uint32_t transaction, const PtpReply& reply) {
  if (reply.data) {
    std::string start, data;
    Append(start, transaction, 4);
    Append(start, reply.data->size(), 8);
    Append(data, transaction, 4);
    if (!Send(socket, kStartData, start) || !Send(socket, kEndData, data + *reply.data))
      return false;
  }
  std::string response;
  Append(response, reply.code, 2);
  Append(response, transaction, 4);
  return Send(socket, kResponse, response);
}

void PtpIpHost::Serve(int commands, int events) {
  over_ = false;
  commands_ = commands;
  {
    const std::lock_guard lock(damage_mutex_);
    const timeval patience{0, damage_ ? 500'000 : 0};  // 0: for ever
    setsockopt(commands, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  std::thread sender([this, events] { SendEvents(events); });
  while (const auto packet = Receive(commands)) {
    if (packet->kind != kOperation) continue;
    const auto operation = ReceiveOperation(commands, *packet);
    if (!operation) break;
    if (mute_) continue;
    if (!SendReply(commands, operation->transaction, camera_.Execute(*operation))) break;
  }
  commands_ = -1;
  over_ = true;
  camera_.Wake();
  shutdown(events, SHUT_RDWR);
  sender.join();
}

void PtpIpHost::SendEvents(int socket) {
  while (!over_) {
    const auto event =
        camera_.WaitEvent(std::chrono::steady_clock::now() + std::chrono::seconds(1));
    if (!event) continue;
    std::string body;
    Append(body, event->code, 2);
    Append(body, 0, 4);
    Append(body, event->parameter, 4);
    if (!Send(socket, kEvent, body)) return;
  }
}

}  // namespace luxfield::fakes
