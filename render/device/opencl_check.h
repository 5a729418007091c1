// OpenCL return codes as exceptions; for the .cc files of render/.
#pragma once

#include <string>

#include "core/error.h"
#include "render/device.h"

namespace luxfield::render {

// Throws "<what> failed: CL_...".
inline void Check(cl_int code, const std::string& what) {
  if (code != CL_SUCCESS) throw DeviceError("OpenCL: " + what + " failed: " + ErrorName(code));
}

}  // namespace luxfield::render
