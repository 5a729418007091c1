// Decoding in a process of its own: a library that somebody's bytes bring down, or keep busy for
// good, takes nothing else with it.
//
// LibRaw needs it: the version of Debian 12, 0.20.2, ends the program over a file whose texts are
// longer than its buffers ("*** buffer overflow detected ***", in identify()).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "hal/gphoto2/raw_file.h"

namespace luxfield::hal::gphoto2 {

// What `decode` returns, or the HardwareError it throws. It runs in a child that begins as a copy
// of this process with nothing open, and that ends with its parent. It may take memory but no lock
// that another thread of this process may hold. Throws HardwareError in the name of `device`:
// kIncomplete where the child ended without an answer, was not done within `within_s`, or answered
// with a picture of more than `most_pixels`; kRefused where no child can be made.
RawFile DecodeApart(const std::function<RawFile()>& decode, const std::string& device,
                    std::size_t most_pixels, double within_s);

}  // namespace luxfield::hal::gphoto2
