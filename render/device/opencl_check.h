// OpenCL return codes as exceptions; for the .cc files of render/.
#pragma once

#include <string>

#include "luxfield/core/error.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

// Throws "<what> failed: CL_...".
inline void Check(cl_int code, const std::string& what) {
  if (code != CL_SUCCESS) throw DeviceError("OpenCL: " + what + " failed: " + ErrorName(code));
}

}  // namespace luxfield::render
