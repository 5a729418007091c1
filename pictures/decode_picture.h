// PNG, JPEG, TIFF and the like through OpenCV's codecs, which run in a process of their own
// (core/apart.h): there are files that bring them down or take all memory, and they write on stderr
// by themselves.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace luxfield::pictures {

// cv::imdecode(bytes, flags); empty if they are no picture. The decoder may take 512 MiB and 16
// bytes for each of the file's. Throws InputError naming `name` where it takes more, or an end
// before its time, DeviceError where no process can be made, Interrupted.
cv::Mat DecodePicture(std::span<const unsigned char> bytes, int flags, const std::string& name);

}  // namespace luxfield::pictures
