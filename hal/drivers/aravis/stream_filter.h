// What may reach the receiver of a camera's stream (GigE Vision stream protocol, GVSP).
//
// aravis 0.8.26 believes what it receives. A datagram that is shorter than its header makes it copy
// (size_t)-1 to -8 bytes, or pixels that an earlier frame left in its receive buffer; a trailer
// with a small number, or a packet of a size that no frame has, ends a frame early that then passes
// for a whole one. So the kernel drops what is no part of a frame before aravis sees it, which then
// asks for it again as for any that was lost.
#pragma once

#include <linux/filter.h>

#include <cstdint>
#include <vector>

namespace luxfield::hal::aravis {

struct StreamGeometry {
  std::uint32_t camera = 0;       // its IPv4 address, in the host's byte order
  std::uint32_t packet_size = 0;  // bytes; the headers of IP, UDP and GVSP are part of it
  std::uint32_t payload = 0;      // bytes of a frame
};

// A filter for UDP sockets. What passes comes from the camera and is one of
//   a leader, of packet 0, with all that an image's leader holds;
//   a payload packet, of 1 to N, as long as the packet size says, the last one holding the rest of
//     the frame at least;
//   a trailer, of packet N + 1,
// with numbers of 16 or of 64 bits. Needs a packet size of more than 48 bytes.
std::vector<sock_filter> FrameFilter(const StreamGeometry& geometry);

// Attaches it to this process's UDP socket that is bound to the port. Throws std::system_error;
// ENOENT where there is no such socket.
void AttachToPort(std::uint16_t port, std::vector<sock_filter> filter);

}  // namespace luxfield::hal::aravis
