// The display protocol of the tev image viewer (https://github.com/Tom94/tev, src/Ipc.cpp), over
// TCP.
//
// A packet is a little-endian uint32 (its whole length, these 4 bytes included), a type byte, a
// payload. Strings end in a zero byte, booleans are one byte. Sent are
//   4 CreateImage      bool grab_focus, string image, int32 width, int32 height, int32 n,
//                      n strings (channels)
//   6 UpdateImage V3   bool grab_focus, string image, int32 n, n strings,
//                      int32 x, y, width, height,
//                      int64 offset[n], int64 stride[n] (in floats), float data
#pragma once

#include <string>

#include "luxfield/core/image.h"

namespace luxfield::render {

// A connection to a running viewer.
class Display {
 public:
  // "host", "host:port", "[::1]:port"; the port defaults to tev's 14158. Throws InputError for an
  // address that makes no sense or is unknown, DeviceError if nothing listens there within
  // `timeout_s`.
  explicit Display(const std::string& address, double timeout_s = 5);
  ~Display();
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  // Makes (or replaces) an image of 1 ("Y") or 3 ("R", "G", "B") channels and brings it to the
  // front.
  void Create(const std::string& name, int width, int height, int channels);
  // Sends rows [first_row, first_row + rows) of `image`, in packets of at most 1 MiB. Throws
  // DeviceError if the viewer is gone or takes nothing for `timeout_s`.
  void Update(const std::string& name, const core::Image& image, int first_row, int rows);
  // Both, for a whole picture.
  void Show(const std::string& name, const core::Image& image);

 private:
  void Send(const std::string& packet);

  std::string address_;
  int socket_ = -1;
};

}  // namespace luxfield::render
