// How many file descriptors the process may still open, for libraries that end the program, or call
// others that do, where they have none left.
#pragma once

namespace luxfield::core {

// At most `wanted`, as many are tried.
//
//   if (core::SpareDescriptors(32) < 32) throw DeviceError("...; raise the limit (ulimit -n)");
int SpareDescriptors(int wanted);

}  // namespace luxfield::core
