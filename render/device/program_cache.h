// Compiled programs on disk, so that a device compiles a kernel once. Internal to render/.
//
// The folder is that of core::CacheFile. A file is
//
//   line   "luxfield program 1 <bytes of key> <bytes of binary> <CRC-32C of key and binary, hex>"
//   key    everything that decides the binary, in full: a file of another key is not used, whatever
//          its name
//   binary
//
// A cache that is absent, damaged or cannot be written costs a compilation, nothing else.
#pragma once

#include <string>

#include "luxfield/render/device/device.h"

namespace luxfield::render {

// Device, driver and compiler by name and version, the build options and the whole source.
std::string ProgramKey(const DeviceInfo& device, const std::string& options,
                       const std::string& source);

// The binary stored under `key`; empty if there is none. `name` is the program's, as a part of the
// file's name.
std::string LoadProgramBinary(const std::string& name, const std::string& key);
void StoreProgramBinary(const std::string& name, const std::string& key, const std::string& binary);

}  // namespace luxfield::render
