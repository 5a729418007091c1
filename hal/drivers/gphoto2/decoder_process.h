// Decoding in a process of its own (core/apart.h).
//
// LibRaw needs it: the version of Debian 12, 0.20.2, ends the program over a file whose texts are
// longer than its buffers ("*** buffer overflow detected ***", in identify()).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "luxfield/hal/drivers/gphoto2/raw_file.h"

namespace luxfield::hal::gphoto2 {

// What `decode` returns, or the HardwareError it throws. Interrupts do not end it: a bracket that
// has begun is finished. Throws HardwareError in the name of `device`: kIncomplete where the child
// ended without an answer, was not done within `within_s`, took more memory than files of
// `most_pixels` need, or answered with a picture of more than these; kRefused where no child can be
// made.
RawFile DecodeApart(const std::function<RawFile()>& decode, const std::string& device,
                    std::size_t most_pixels, double within_s);

}  // namespace luxfield::hal::gphoto2
