#include "luxfield/hal/drivers/aravis/stream_filter.h"

#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <string>
#include <system_error>

namespace luxfield::hal::aravis {
namespace {

// Bytes. The filter of a UDP socket sees the datagram from its UDP header on.
constexpr std::uint32_t kIpHeader = 20, kUdpHeader = 8, kImageLeader = 36, kTrailer = 8;
// Of the packet's format byte.
constexpr std::uint32_t kExtendedBit = 0x80, kContentBits = 0x7f;
constexpr std::uint32_t kLeaderContent = 1, kTrailerContent = 2, kPayloadContent = 3;

// Where the packet's number is (GigE Vision 2.0, GVSP header).
struct Header {
  std::uint32_t bytes = 0, number_at = 0, number_bits = 0;
};
constexpr Header kStandard = {8, 4, 0x00ffffff}, kExtended = {20, 16, 0xffffffff};
constexpr std::uint32_t kFormatAt = 4;

// Instructions, each of which works on the accumulator.
class Program {
 public:
  void LoadLength() { Add(BPF_LD | BPF_W | BPF_LEN, 0); }
  void LoadByte(std::uint32_t at) { Add(BPF_LD | BPF_B | BPF_ABS, at); }
  void LoadHalf(std::uint32_t at) { Add(BPF_LD | BPF_H | BPF_ABS, at); }
  void LoadWord(std::uint32_t at) { Add(BPF_LD | BPF_W | BPF_ABS, at); }
  void And(std::uint32_t bits) { Add(BPF_ALU | BPF_AND | BPF_K, bits); }
  void Accept() { Add(BPF_RET | BPF_K, 0xffffffff); }
  void Drop() { Add(BPF_RET | BPF_K, 0); }

  template <typename Body>
  void IfEqual(std::uint32_t value, const Body& body) {
    Branch(BPF_JEQ, value, true, body);
  }
  template <typename Body>
  void IfAnyBit(std::uint32_t bits, const Body& body) {
    Branch(BPF_JSET, bits, true, body);
  }
  void RequireEqual(std::uint32_t value) {
    Branch(BPF_JEQ, value, false, [this] { Drop(); });
  }
  void RequireAtLeast(std::uint32_t value) {
    Branch(BPF_JGE, value, false, [this] { Drop(); });
  }
  void RequireAtMost(std::uint32_t value) {
    Branch(BPF_JGT, value, true, [this] { Drop(); });
  }
  std::vector<sock_filter> Take() { return std::move(code_); }

 private:
  void Add(int code, std::uint32_t operand) {
    code_.push_back({static_cast<std::uint16_t>(code), 0, 0, operand});
  }
  // The body where the comparison gives `when`; jumps over it otherwise.
  template <typename Body>
  void Branch(int comparison, std::uint32_t value, bool when, const Body& body) {
    Add(BPF_JMP | comparison | BPF_K, value);
    const std::size_t branch = code_.size();
    body();
    const auto over = static_cast<std::uint8_t>(code_.size() - branch);
    (when ? code_[branch - 1].jf : code_[branch - 1].jt) = over;
  }

  std::vector<sock_filter> code_;
};

void RequireLength(Program& program, std::uint32_t least, std::uint32_t most) {
  program.LoadLength();
  program.RequireAtLeast(least);
  program.RequireAtMost(most);
}

// Packets with this header: accepted or dropped.
void JudgePacket(Program& program, const Header& header, const StreamGeometry& geometry) {
  constexpr std::uint32_t kAnyLength = 0xffff;
  const std::uint32_t block = geometry.packet_size - kIpHeader - kUdpHeader - header.bytes;
  const std::uint32_t packets = (geometry.payload + block - 1) / block;
  const std::uint32_t last_block = geometry.payload - (packets - 1) * block;
  const std::uint32_t data_at = kUdpHeader + header.bytes;
  const auto load_number = [&] {
    program.LoadWord(kUdpHeader + header.number_at);
    program.And(header.number_bits);
  };
  const auto if_content = [&](std::uint32_t content, const auto& body) {
    program.LoadByte(kUdpHeader + kFormatAt);
    program.And(kContentBits);
    program.IfEqual(content, body);
  };
  if_content(kLeaderContent, [&] {
    load_number();
    program.RequireEqual(0);
    RequireLength(program, data_at + kImageLeader, kAnyLength);
    // An image (1) or an image in extended chunks (5), which have the same leader; the flag of
    // chunks behind an image is above these bits.
    program.LoadHalf(data_at + 2);
    program.And(0x3ffb);
    program.RequireEqual(1);
    program.Accept();
  });
  if_content(kTrailerContent, [&] {
    load_number();
    program.RequireEqual(packets + 1);
    RequireLength(program, data_at + kTrailer, kAnyLength);
    program.Accept();
  });
  if_content(kPayloadContent, [&] {
    load_number();
    program.RequireAtLeast(1);
    program.RequireAtMost(packets);
    program.IfEqual(packets, [&] {
      RequireLength(program, data_at + last_block, data_at + block);
      program.Accept();
    });
    RequireLength(program, data_at + block, data_at + block);
    program.Accept();
  });
  program.Drop();
}

bool IsBoundTo(int descriptor, std::uint16_t port) {
  int type = 0;
  socklen_t size = sizeof type;
  if (getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM)
    return false;
  sockaddr_in address{};
  size = sizeof address;
  return getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

// aravis keeps its socket to itself; the system knows it by its port.
int FindSocket(std::uint16_t port) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::string name = entry.path().filename();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    if (IsBoundTo(descriptor, port)) return descriptor;
  }
  throw std::system_error(ENOENT, std::generic_category(), "UDP port " + std::to_string(port));
}

}  // namespace

std::vector<sock_filter> FrameFilter(const StreamGeometry& geometry) {
  constexpr std::uint32_t kIpSourceAt = 12;
  Program program;
  program.LoadWord(static_cast<std::uint32_t>(SKF_NET_OFF) + kIpSourceAt);
  program.RequireEqual(geometry.camera);
  program.LoadByte(kUdpHeader + kFormatAt);
  program.IfAnyBit(kExtendedBit, [&] { JudgePacket(program, kExtended, geometry); });
  JudgePacket(program, kStandard, geometry);
  return program.Take();
}

void AttachToPort(std::uint16_t port, std::vector<sock_filter> filter) {
  const sock_fprog program = {static_cast<std::uint16_t>(filter.size()), filter.data()};
  if (setsockopt(FindSocket(port), SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0)
    throw std::system_error(errno, std::generic_category(), "SO_ATTACH_FILTER");
}

}  // namespace luxfield::hal::aravis
